"""A modal test with ten known modes, in every way that measuring systems write it: all ten are
right, or one sentence states what is missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.arrangement import arrange
from tyrecal.measured.gather import Gathered, gather
from tyrecal.measured.modal import Layout
from tyrecal.measured.tables import read_measurements
from tyrecal.measured.universal import Function, Universal, read_universal

from ..chance import generator
from .ten_modes import (
    AXES,
    MODES,
    NUMBERS,
    POINTS,
    THETA,
    WAYS,
    F,
    Z,
    accelerances,
    along_xyz,
    files,
    functions,
    nodes,
    shapes,
    systems_18,
    units,
    with_component,
)
from .test_universal import function, write

pytestmark = pytest.mark.numbers

LAYOUT = Layout(highest=8, band=(30.0, 170.0))
QUICK = {"a frame per node, 18", "components", "shapes, 55", "hammer", "runs", "a broken cable"}
NOTES = {
    "components": "left out, not on the tyre: 48 functions of component hub",
    "hammer": "0.uff: the impacts were moved over 48 channels; by reciprocity",
    "runs": "one test in 4 files with a common reference: 1.uff, 2.uff, 3.uff, 4.uff",
    "a broken cable": "left out, mostly noise: channel 5:2",
    "no motion": "left out, no motion along a direction 1, 2 or 3: channel 500:4, 501:0",
    "directions of the sensors": "--directions cylindrical is taken",
}


def imported(folder: Path, way: str) -> Gathered:
    return gather(files(folder, way), 240.0, LAYOUT, assumed=0.002)


@pytest.mark.parametrize(
    "way",
    [pytest.param(w, marks=[pytest.mark.slow] * (w not in QUICK)) for w in WAYS] + ["shapes, 2414"],
)
def test_ten_modes_are_right_however_they_are_written(tmp_path: Path, way: str) -> None:
    result = imported(tmp_path, way)
    assert {row.label: row.value for row in result.rows} == pytest.approx(MODES, rel=1e-3)
    assert len(result.runs) == 1 and result.runs[0].explained > 0.99
    damping = [mode.mode.damping for mode in result.runs[0].modes]
    assert damping == pytest.approx([0.025] * 10, rel=0.05)
    assert [row.damping_ratio for row in result.rows] == pytest.approx([0.025] * 10, rel=0.05)
    if way in NOTES:
        assert any(NOTES[way] in note for note in result.notes), result.notes
    else:
        assert not result.notes


def few(each: dict[str, Any]) -> dict[str, Any]:
    """A shape at its first three nodes alone."""
    return each | {name: each[name][:3] for name in ("node_nums", "r1", "r2", "r3")}


REFUSED = [
    (
        lambda: [nodes(2411, 17), *functions(accelerances())],
        r"\(type 2411, line 1\): the directions of node 1 are in coordinate system 17, which the"
        " file does not define",
    ),
    (
        lambda: [nodes(15, 11), systems_18() | {"cs_type": np.full(16, 2)}],
        r"data set 2 \(type 18, line \d+\): system 11 is spherical; tyrecal reads Cartesian and",
    ),
    (
        lambda: [systems_18() | {"x_point": systems_18()["ref_o"]}],
        "the axes of system 11 are not at right angles",
    ),
    (lambda: [systems_18(), systems_18()], "system 11 is given in two data sets"),
    (
        lambda: [nodes(), nodes(places=1.01 * POINTS)],
        r"data set 2 \(type 2411, line \d+\): node 1 is given twice, at different places",
    ),
    (
        lambda: [units(), units(1e3)],
        r"data set 2 \(type 164, line 7\): the factor of the length is 1000.0, before 1.0",
    ),
    (
        lambda: [nodes(), *functions(along_xyz(), orddenom_spec_data_type=12)],
        "nor a frequency-response function, only 1 x acceleration over acceleration, channel 1:1,",
    ),
    (
        lambda: [
            nodes(),
            *with_component(functions(along_xyz()), "ring"),
            *with_component(functions(along_xyz()), "hub"),
        ],
        "node 1 is one of the component 'ring' and one of 'hub'; take away what is not on the tyre",
    ),
    (
        lambda: [nodes(15, NUMBERS + 10), systems_18(), *shapes(AXES)],
        "the shapes do not fit the directions of the file's coordinate systems",
    ),
    (
        lambda: [nodes(), few(shapes(AXES)[3])],
        r"the shapes do not show whether directions .* give --directions cartesian \(along",
    ),
    (
        lambda: [nodes(), *functions(along_xyz()), functions(along_xyz())[3]],
        "node 2, direction 1 was",
    ),
]


@pytest.mark.parametrize(("sets", "words"), REFUSED, ids=[words[-30:] for _, words in REFUSED])
def test_what_cannot_be_used_is_refused_by_its_place(
    tmp_path: Path, sets: Callable[[], list[dict[str, Any]]], words: str
) -> None:
    path = write(tmp_path / "f.uff", *sets())
    with pytest.raises(InputError, match=words) as error:
        gather([path], 240.0, LAYOUT, assumed=0.002)
    assert str(error.value).startswith(str(path)) and "\n" not in str(error.value)


def test_a_type_that_may_change_places_is_refused_and_elements_are_not(tmp_path: Path) -> None:
    """781 are nodes of an older kind; 2412 and 1858 change no frequency and no shape."""
    path = write(tmp_path / "f.uff", units(), nodes(), *shapes(AXES))
    whole = path.read_text()
    for kind, known in ((781, False), (3333, False), (2412, True), (1858, True)):
        path.write_text(f"{whole}    -1\n{kind:6d}\n         1\n    -1\n")
        if known:
            assert len(gather([path], 240.0, LAYOUT, assumed=0.002).rows) == 10
        else:
            with pytest.raises(
                InputError, match=rf"\(type {kind}, line \d+\): tyrecal does not read"
            ):
                gather([path], 240.0, LAYOUT)


@pytest.mark.slow
def test_directions_that_the_shapes_contradict_are_doubted(tmp_path: Path) -> None:
    path = write(tmp_path / "f.uff", units(), nodes(), *functions(along_xyz()))
    for given, doubted in (("cartesian", False), ("cylindrical", True)):
        layout = replace(LAYOUT, directions=given)
        note = [
            n for n in gather([path], 240.0, layout).notes if "is given, but the shapes fit" in n
        ]
        assert bool(note) == doubted


def test_one_geometry_in_two_kinds_of_nodes(tmp_path: Path) -> None:
    """The older kind has six digits and its places in a cylindrical system."""
    places = np.column_stack([np.full(16, 0.33), np.degrees(THETA), Z])
    turned = nodes(15, 11, places=places) | {"def_cs": np.full(16, 11)}
    file = read_universal(write(tmp_path / "f.uff", systems_18(1), nodes(), turned))
    assert np.array([file.nodes[n] for n in NUMBERS]) == pytest.approx(POINTS, abs=1e-5)
    assert np.array([file.axes[n] for n in NUMBERS]) == pytest.approx(AXES, abs=1e-4)


def test_channels_can_be_taken_away(tmp_path: Path) -> None:
    """Channels are left out by node, direction and component; a name that fits none is refused."""
    sets = [nodes(), *with_component(functions(along_xyz()), "Ring"), *functions(along_xyz())]
    path = write(tmp_path / "f.uff", *sets)
    file = read_universal(path)
    for names, left in (
        (["ring"], 48),
        (["RING", "3"], 45),
        (["ring", "3:2", "4:2"], 46),
        (["ring:3", "ring:4:2", "ring"], 48),
    ):
        assert len(arrange([file], names).tests[0].functions) == left
    for name, words in (("77", "no file has such a channel"), ("3:x:1", "must be NODE, NODE:DIR")):
        with pytest.raises(InputError, match=f"--leave-out {name}: {words}"):
            arrange([file], [name])
    shaped = read_universal(write(tmp_path / "s.uff", *shapes(AXES)))
    (test,), _ = arrange([shaped], ["5:2", "7"])
    gone = np.isnan(test.shapes[0].values)
    assert gone[4].tolist() == [False, True, False] and gone[6].all()
    assert gone[np.delete(np.arange(16), [4, 6])].sum() == np.isnan(shaped.shapes[0].values).sum()


def test_a_hammer_that_was_moved_is_noticed_over_all_files() -> None:
    """Three fixed channels and one impact a file; of a shaker's and a hammer's test each by its
    own."""
    H = np.ones(len(F), complex)
    fixed = [[Function(F, H, None, (3, k), (i, 1), "") for k in (1, 2, 3)] for i in range(101, 111)]
    one = [Universal(Path(f"{i}.uff"), {}, [], each) for i, each in enumerate(fixed)]
    (test,), notes = arrange(one)
    assert {each.response[0] for each in test.functions} == set(range(101, 111))
    assert len(test.functions) == 30 and notes[0].startswith("0.uff, 1.uff, 2.uff, ")
    shaker = Universal(
        Path("s"), {}, [], [Function(F, H, None, (i, 1), (9, 1), "") for i in range(9)]
    )
    hammer = Universal(
        Path("h"), {}, [], [Function(F, H, None, (3, 1), (i, 2), "") for i in range(8)]
    )
    tests, (note,) = arrange([shaker, hammer])
    assert [{each.response[1] for each in test.functions} for test in tests] == [{1}, {2}]
    assert note.startswith("h: the impacts were moved over 8 channels")


@pytest.mark.slow
@pytest.mark.parametrize("size", [4.0, 1e4])
def test_a_channel_that_spoils_the_rest_is_named(tmp_path: Path, size: float) -> None:
    """A drift in channel 5:2, which is no noise from line to line: a little, and so much that no
    mode can be found."""
    H = along_xyz().copy()
    steps = generator("drift").standard_normal((2, len(F)))
    drift = np.cumsum(np.convolve(steps[0] + 1j * steps[1], np.ones(9) / 9, "same"))
    H[4, 1] += size * np.abs(H).max() / np.abs(drift).max() * drift
    path = write(tmp_path / "f.uff", nodes(), *functions(H))
    try:
        result = gather([path], 240.0, LAYOUT, assumed=0.002)
    except InputError as error:
        assert "channel 5:2 is " in str(error) and str(error).endswith("try --leave-out 5:2")
    else:
        assert any("the rest is channel 5:2: try --leave-out 5:2" in note for note in result.notes)
    right = gather([path], 240.0, LAYOUT, assumed=0.002, leave_out=["5:2"])
    assert {row.label: row.value for row in right.rows} == pytest.approx(MODES, rel=1e-3)
    assert not right.notes


def test_functions_come_in_one_unit_or_are_refused() -> None:
    """Files with g next to files with m/s^2 are refused, and so is an unknown unit."""
    units_of = lambda *words: [
        Function(F, np.ones(len(F), complex), None, (k, 1), (9, 1), f"p{k}", unit=word)
        for k, word in enumerate(words)
    ]
    values = lambda *words: [
        each.values[0].real
        for each in arrange([Universal(Path("f"), {}, [], units_of(*words))]).tests[0].functions
    ]
    assert values("m/s^2", "g", "mm/s2/n", "g/lbf") == pytest.approx([1, 9.80665, 1e-3, 2.2046226])
    assert values("furlong", "furlong", "") == [1, 1, 1]
    with pytest.raises(InputError, match="p1: states the unit 'furlong', and other functions"):
        values("g", "furlong")


def test_repeats_of_a_test_in_parts_stay_repeats(tmp_path: Path) -> None:
    """A pair of runs of four parts each, given one after the other, is two tests. A channel that
    each part has, such as the driving point, does not make them repeats."""
    sets = functions(along_xyz())
    driving = function(along_xyz()[0, 0], F, 99, ref_node=99, ref_dir=1, ord_data_type=5, binary=1)
    parts = [[driving, *sets[k : k + 12]] for k in range(0, 48, 12)]
    runs = [read_universal(write(tmp_path / f"{k}.uff", *p)) for k, p in enumerate(2 * parts)]
    tests, notes = arrange(runs)
    assert [len(test.functions) for test in tests] == [49, 49] and len(notes) == 2
    assert notes[1].endswith("4.uff, 5.uff, 6.uff, 7.uff")
    others = [
        read_universal(write(tmp_path / f"o{k}.uff", *functions(along_xyz(k), k))) for k in (0, 1)
    ]
    assert len(arrange(others).tests) == 2  # another reference


@pytest.mark.parametrize(
    ("head", "name"),
    [
        (b"MATLAB 5.0 MAT-file, Platform: GLNXA64" + bytes(200), r"MATLAB file \(.mat\)"),
        (b"MATLAB 7.3 MAT-file" + bytes(493) + b"\x89HDF\r\n\x1a\n", r"MATLAB file \(.mat\)"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "HDF5 file"),
    ],
)
def test_other_formats_are_named(tmp_path: Path, head: bytes, name: str) -> None:
    path = tmp_path / "file"
    path.write_bytes(head)
    with pytest.raises(InputError, match=f"this is a {name}; tyrecal reads tables"):
        gather([path], 240.0)


@pytest.mark.parametrize("head", [b"$ a comment\n[MDI_HEADER]\n", b"**HEADER\nRELEASE 1.3\n"])
def test_other_formats_have_to_be_imported(tmp_path: Path, head: bytes) -> None:
    path = tmp_path / "file"
    path.write_bytes(head)
    with pytest.raises(InputError, match="'tyrecal measured import' makes a table of it"):
        read_measurements(path)
