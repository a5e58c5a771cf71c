"""ABAQUS files, synthesised here record by record from the rules of their format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.abaqus.evidence import read_dat
from tyrecal_solvers.abaqus.fil import read_fil
from tyrecal_solvers.abaqus.launch import denial, is_queueing, read_options
from tyrecal_solvers.errors import Refused, RunFailed
from tyrecal_solvers.rings import check_revolved, components, cylindrical

BLANK = " " * 80 + "\n"


def integer(value: int) -> str:
    digits = str(value)
    return "I" + str(len(digits)).rjust(2) + digits


def real(value: float) -> str:
    mantissa, exponent = f"{value:.15e}".split("e")
    letter = "D" if len(exponent) == 3 else ""  # as Fortran does: the field is 22 wide
    return "D" + f"{mantissa}{letter}{exponent}".rjust(22)


def word(text: str) -> str:
    return "A" + text.ljust(8)


def record(key: int, *items: str) -> str:
    return "*" + integer(2 + len(items)) + integer(key) + "".join(items)


def lines(data: str) -> str:
    """80 characters each, the last one filled, and a blank line."""
    rows = [data[i : i + 80].ljust(80) + "\n" for i in range(0, len(data), 80)]
    return "".join(rows) + BLANK


HEAD = [
    record(1921, word("6.14-1"), word("21-Nov-2"), word("026"), *map(integer, (1, 3)), real(0.02)),
    *(
        record(1901, integer(n), real(x), real(y), real(z))
        for n, x, y, z in ((7, 0.3, -0.05, 0.0), (8, 0.3, 0.05, 0.0), (1000007, 0.0, -0.05, -0.3))
    ),
    record(1902, *map(integer, (1, 2, 3, 0, 0, 0))),
    record(1922, *map(word, ("a tyre",) + ("",) * 9)),
]
START = record(2000, *map(real, (1.0, 1e-36)), *map(word, ("",) * 19))
END = record(2001)
OUTPUT = record(1911, integer(1), word("CROWN"), word(""))
SHAPES = np.array(
    [[[1e-3, 0.25, -1.5], [0.0, -3e-12, 2.0]], [[1.0, 2.0, 3.0], [4.0, 5.0, -6.5e101]]]
)
VALUES = (53712.123456789012, 98765432.1)


def mode(number: int, value: float, shape: np.ndarray, participation: int = 6) -> str:
    head = record(
        1980, integer(number), real(value), real(2.0), real(0.0), *[real(0.5)] * (2 * participation)
    )
    motion = [
        record(101, integer(n), *map(real, u)) for n, u in zip((8, 1000007), shape, strict=True)
    ]
    return head + OUTPUT + "".join(motion)


def whole(participation: int = 6) -> str:
    static = lines("".join(HEAD) + START + record(101, integer(8), *map(real, (9, 9, 9))) + END)
    modes = "".join(
        mode(k, v, u, participation)
        for k, (v, u) in enumerate(zip(VALUES, SHAPES, strict=True), start=1)
    )
    return static + lines(START + modes + END)


def test_the_synthesised_items_are_those_of_real_files() -> None:
    assert integer(4) == "I 14" and integer(1901) == "I 41901" and integer(36) == "I 236"
    assert real(0.1) == "D 1.000000000000000D-01"


@pytest.mark.parametrize("participation", [3, 6])
def test_modes_shapes_and_coordinates(tmp_path: Path, participation: int) -> None:
    text = whole(participation)
    assert all(len(line) == 80 for line in text.splitlines())
    path = tmp_path / "modes.fil"
    path.write_text(text)
    modes = read_fil(path)
    assert modes.eigenvalues.tolist() == list(VALUES)
    assert modes.masses.tolist() == [2.0, 2.0]
    assert modes.nodes.tolist() == [8, 1000007]
    assert modes.coordinates.tolist() == [[0.3, 0.05, 0.0], [0.0, -0.05, -0.3]]
    assert np.array_equal(modes.displacement, SHAPES)


def test_forms_that_other_releases_may_write(tmp_path: Path) -> None:
    path = tmp_path / "modes.fil"
    apart = "".join(
        lines(START + mode(k, v, u) + END)
        for k, (v, u) in enumerate(zip(VALUES, SHAPES, strict=True), start=1)
    )
    path.write_text(lines("".join(HEAD)) + apart)  # an increment for each mode
    assert np.array_equal(read_fil(path).displacement, SHAPES)
    path.write_text("\r\n".join(line.rstrip() for line in whole().splitlines()))
    assert np.array_equal(read_fil(path).displacement, SHAPES)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda text: text[: len(text) // 2], "cut short|not given at the same nodes"),
        (lambda text: text[: -81 - 81], "does not end|cut short"),
        (lambda text: text + lines(START + mode(1, 5.0, SHAPES[0]) + END), "mode 1 .* twice"),
        (lambda text: text + text, "twice"),
        (lambda text: "", "does not end"),
        (lambda text: lines("".join(HEAD) + START + END), "no mode"),
        (lambda text: lines(START + mode(1, 5.0, SHAPES[0]) + END), "node 8 has no coordinates"),
        (lambda text: lines(START + record(1980, integer(1), *[real(1.0)] * 3) + END), "SIM=NO"),
        (lambda text: text.replace("*", "+", 1), "does not begin"),
        (lambda text: text.replace("D 1.0", "D *.*", 1), "damaged"),
        (lambda text: "x" * 81, "longer than 80"),
    ],
)
def test_a_file_that_is_not_whole(
    tmp_path: Path, spoil: Callable[[str], str], message: str
) -> None:
    path = tmp_path / "modes.fil"
    path.write_text(spoil(whole()))
    with pytest.raises(RunFailed, match=message) as failure:
        read_fil(path)
    assert failure.value.cause == "no_results"


def test_every_cut_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "modes.fil"
    data = "".join(HEAD) + START + mode(1, VALUES[0], SHAPES[0]) + END
    text = lines(data)
    for stop in range(len(data) + len(data) // 80):
        path.write_text(text[:stop])
        with pytest.raises(RunFailed):
            read_fil(path)


DAT = """
   TOTAL MASS OF MODEL
      12.8045

                              E I G E N V A L U E    O U T P U T

 MODE NO      EIGENVALUE              FREQUENCY         GENERALIZED MASS   COMPOSITE MODAL DAMPING
                             (RAD/TIME)   (CYCLES/TIME)


       1      7827.2          88.471          14.081          47.597          0.0000
       2     1.01965E+05      319.32          50.822          1.0000          0.0000

                     P A R T I C I P A T I O N   F A C T O R S

 MODE NO     X-COMPONENT     Y-COMPONENT     Z-COMPONENT     X-ROTATION      Y-ROTATION
       3      0.1             0.2             0.3             0.4             0.5
"""


def test_the_printed_table(tmp_path: Path) -> None:
    path = tmp_path / "modes.dat"
    assert read_dat(path).frequencies_Hz == {}
    path.write_text(DAT)
    table = read_dat(path)
    assert table.frequencies_Hz == {1: 14.081, 2: 50.822}
    assert table.mass == 12.8045
    path.write_text(DAT.replace("\n      12.8045", " =  1.28045D+01"))
    assert read_dat(path).mass == 12.8045


def test_cylindrical_components() -> None:
    theta = np.array([0.0, 0.4, 2.0, -2.5])
    point = np.column_stack([0.3 * np.cos(theta), 0.05 + 0 * theta, -0.3 * np.sin(theta)])
    assert np.allclose(cylindrical(point).T, [[0.3] * 4, theta, [0.05] * 4])
    spin = np.cross([0.0, 1.0, 0.0], point)  # about the axle: along theta, by R
    assert np.allclose(components(spin, theta), [0.0, 0.3, 0.0])
    assert np.allclose(components(point, theta), [0.3, 0.0, 0.05])


def test_nodes_that_are_not_round_the_axle() -> None:
    theta = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.column_stack([0.3 * np.cos(theta), 0 * theta, -0.3 * np.sin(theta)])
    check_revolved(cylindrical(ring))
    for wrong in (ring[:, [1, 0, 2]], ring[:1], ring[:6]):
        with pytest.raises(RunFailed, match="are not round the axle"):
            check_revolved(cylindrical(wrong))


@pytest.mark.parametrize(
    "line",
    [
        "Abaqus Error: Abaqus/Standard license check out failed",
        "FLEXnet Licensing error:-4,132",
        "Licensed number of users already reached.",
        "Cannot checkout 5 tokens",
        "No socket connection to license server manager: unable to get a licence",
        "No license for abaqus is available",
        "Insufficient tokens",
    ],
)
def test_a_denied_licence(line: str) -> None:
    assert denial(f"Begin Analysis\n{line}\nend") == line


@pytest.mark.parametrize(
    "line",
    [
        "Abaqus License Manager checked out the following licenses:",
        "Abaqus/Standard checked out 5 tokens from Flexnet server nowhere.",
        "<49 out of 54 licenses remain available>.",
        "***ERROR: TOO MANY ATTEMPTS MADE FOR THIS INCREMENT",
    ],
)
def test_a_licence_that_was_granted(line: str) -> None:
    assert not denial(line)
    assert not is_queueing(line)


def test_a_job_that_still_queues() -> None:
    assert is_queueing("Queued for 5 Abaqus/Standard licenses")
    assert is_queueing("Waiting for license tokens")
    assert not denial("Waiting for license tokens")


def test_options() -> None:
    assert read_options({"licence_wait_s": 0}).licence_wait_s == 0
    for bad in (
        {"comand": "abaqus"},
        {"command": "abaqus"},
        {"licence_wait_s": -1},
        {"licence_wait_s": "long"},
        {"licence_wait_s": float("nan")},
        {"licence_first_wait_s": 0},
    ):
        with pytest.raises(Refused, match=r"solver\.options"):
            read_options(bad)
