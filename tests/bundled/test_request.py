"""The side file of a job: whatever is wrong in it is told with its key; what the command says.

Pairs of jobs that are refused, as they mean something else than the tool would write.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from tyrecal_solvers.bundled.__main__ import _words, main
from tyrecal_solvers.bundled.deck.request import Request, read_request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.errors import Refused, RunFailed
from tyrecal_solvers.language.text import DeckError, Place

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.case import with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .support import FREQUENCY, MASS, PLAIN, STEP, TURNING, WHEEL, run, texts

ROW = ["inflate", 30, 0, 1.0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The decks of a coarse tyre."""
    path = tmp_path_factory.mktemp("decks")
    case = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
    for name, text in Decks(TyreDesign(case)).texts("abaqus").items():
        (path / name).write_text(text)
    return path


def refusal(folder: Path, request: Any, capsys: pytest.CaptureFixture[str]) -> str:
    """Message of the command about a request that it refuses."""
    text = request if isinstance(request, str) else json.dumps(request)
    (folder / "modes.request.json").write_text(text)
    assert main([str(folder / "modes.inp"), "--oldjob", "inflate"]) == 2
    captured = capsys.readouterr()
    assert not captured.out and captured.err.count("\n") == 1
    return captured.err


def response(point: list[Any]) -> dict[str, Any]:
    """A request of one, to a force at a point: Theta in degrees and a direction."""
    band = {"lowest_Hz": 10.0, "highest_Hz": 200.0, "lines": 5, "patch_m": 0.02, "modes": None}
    return {**band, "excite": [point], "respond": [[180.0, "lateral"]]}


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ("{", "is not JSON"),
        ("[" * 100_000, "is not JSON"),
        ([1], "the request is [1], must be an object"),
        ({"harmonic": [1]}, "harmonic is [1], no such key; there are harmonics, modes_per"),
        ({"harmonics": ["x"]}, 'harmonics[0] is "x", must be a valid integer'),
        ({"harmonics": [0, float("nan")]}, "harmonics[1] is NaN"),
        ({"harmonics": [1.0]}, "harmonics[0] is 1.0"),
        ({"harmonics": [-1]}, "harmonics[0] is -1"),
        ({"harmonics": [10**400]}, "harmonics[0] is 1000"),
        ({"harmonics": [2, 2]}, "harmonics is [2, 2], must have each harmonic once"),
        ({"harmonics": []}, "harmonics is [], "),
        ({"harmonics": 3}, "harmonics is 3, must be a valid"),
        ({"modes_per_harmonic": "x"}, 'modes_per_harmonic is "x", must be a valid integer'),
        ({"modes_per_harmonic": 0}, "modes_per_harmonic is 0"),
        ({"modes_per_harmonic": True}, "modes_per_harmonic is true"),
        ({"sensitivities": []}, "sensitivities is [], must be an object"),
        ({"sensitivities": {"A": 1}}, "sensitivities.A is 1, must be a valid "),
        ({"sensitivities": {"A": [1]}}, "sensitivities.A[0] is 1, must be a valid "),
        (
            {"sensitivities": {"A": [ROW[:3]]}},
            "sensitivities.A[0][3] is missing; a row is [job, line, ",
        ),
        ({"sensitivities": {"A": [["nix", *ROW[1:]]]}}, "[0][0] is nix, must be a job: modes or"),
        ({"sensitivities": {"A": [["inflate", "1", 0, 1.0]]}}, 'sensitivities.A[0][1] is "1"'),
        ({"sensitivities": {"A": [["inflate", 30, -1, 1.0]]}}, "sensitivities.A[0][2] is -1"),
        ({"sensitivities": {"A": [["inflate", 30, 0, None]]}}, "sensitivities.A[0][3] is null"),
        (
            {"sensitivities": {"A": [["inflate", 30, 99, 1.0]]}},
            "line 30: a sensitivity is requested",
        ),
        ({"sensitivities": {"A": [["inflate", 10**9, 0, 1.0]]}}, "the line holds no data"),
        ({"own_frequency": "yes"}, 'own_frequency is "yes", must be a valid boolean'),
        ({"cavity": True}, "cavity is true, must be an object"),
        (
            {"cavity": {"material": 1, "surfaces": ["A"]}},
            "cavity.material is 1, must be a valid string",
        ),
        ({"cavity": {"material": "A", "surfaces": 1}}, "cavity.surfaces is 1, must be a valid"),
        ({"cavity": {"material": "A", "surfaces": [None]}}, "cavity.surfaces[0] is null"),
        ({"response": response([0.0, "radial", 0.1])}, "a point is [angle in degrees, direction]"),
        ({"sector": {"job": "inflate"}}, "sector.width_deg is missing"),
        ({"sector": {"job": "nix", "width_deg": 1}}, "sector.job is nix, must be a job"),
        (
            {"sector": {"job": "../inflate", "width_deg": 1}},
            "must be a job with its deck in the same folder",
        ),
        ({"sector": {"job": 3, "width_deg": 1}}, "sector.job is 3, must be a valid string"),
        ({"sector": {"job": "inflate", "width_deg": "x"}}, 'sector.width_deg is "x"'),
        ({"sector": {"job": "inflate", "width_deg": 400}}, "must be less than or equal to 360"),
    ],
)
def test_a_wrong_request_is_one_sentence(
    folder: Path, request_: Any, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    message = refusal(folder, request_, capsys)
    assert words in message
    assert message.startswith(
        ("error: modes.request.json: ", "error: inflate.inp, ", "error: deck")
    )


@pytest.mark.parametrize(
    ("request_", "fine"),
    [
        ({"harmonics": [0, 999]}, True),
        ({"harmonics": [1000]}, False),
        ({"harmonics": None}, True),
        ({"modes_per_harmonic": 1}, True),
        ({"modes_per_harmonic": 999}, True),
        ({"modes_per_harmonic": 1000}, False),
        ({"sensitivities": {"A": [["modes", 1, 0, 0]]}}, True),
        ({"sensitivities": {"A": [["modes", 0, 0, 0]]}}, False),
        ({"sensitivities": {"A": [["modes", 1, 0, -1e300]]}}, True),
        ({"sensitivities": {"A": [["modes", 1, 0, 1.1e300]]}}, False),
        ({"sensitivities": {"A": [["modes", 1, 0, True]]}}, False),
        ({"sensitivities": {"A": [["modes", 1, 0, 1.0, 1.0]]}}, False),
        ({"response": response([0.0, "radial"])}, True),
        ({"response": response([0.0, "radial", 0.1])}, False),
        ({"response": response([0.0])}, False),
        ({"own_frequency": True}, True),
        ({"cavity": None}, True),
        ({"cavity": {"material": "AIR", "surfaces": ["A", "B"]}}, True),
        ({"cavity": {"material": "AIR", "surfaces": []}}, False),
        ({"cavity": {"material": "AIR", "surfaces": ["A"], "more": 1}}, False),
        ({"cavity": {"material": "", "surfaces": ["A"]}}, False),
        ({"sector": None}, True),
        ({"sector": {"job": "other", "width_deg": 360}}, True),
        ({"sector": {"job": "other", "width_deg": 1e-9}}, True),
        ({"sector": {"job": "other", "width_deg": 0}}, False),
        ({"sector": {"job": "other", "width_deg": 360.1}}, False),
    ],
)
def test_requests_at_their_limits(tmp_path: Path, request_: dict[str, Any], fine: bool) -> None:
    (tmp_path / "other.inp").write_text("*HEADING\n")
    path = tmp_path / "modes.request.json"
    path.write_text(json.dumps(request_))
    if fine:
        result = read_request(path, ["modes"])
        assert all(
            json.loads(json.dumps(getattr(result, key), default=vars)) == value
            for key, value in request_.items()
        )
    else:
        with pytest.raises(Refused):
            read_request(path, ["modes"])


def test_what_a_request_does_not_ask_for_is_not_done(tmp_path: Path) -> None:
    """The default is two modes of each harmonic, at the moduli of the deck, without
    sensitivities."""
    path = tmp_path / "modes.request.json"
    for result in (read_request(path, ["modes"]), path.write_text("{}") and read_request(path, [])):
        assert result == Request(None, 2, {}, False, None, None)  # type: ignore[comparison-overlap]


def test_rows_may_be_of_the_sectors_job(tmp_path: Path) -> None:
    (tmp_path / "other.inp").write_text("*HEADING\n")
    path = tmp_path / "modes.request.json"
    for sector, fine in (({"job": "other", "width_deg": 9}, True), (None, False)):
        rows = {"A": [["other", 1, 0, 1.0]]}
        path.write_text(json.dumps({"sector": sector, "sensitivities": rows}))
        if fine:
            assert read_request(path, ["modes"]).sensitivities == {"A": [("other", 1, 0, 1.0)]}
        else:
            with pytest.raises(Refused, match="must be a job: modes"):
                read_request(path, ["modes"])


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (RunFailed("timed_out", "later\x1b[31m"), 3, "failed: later [31m\n"),
        (RunFailed("unstable", "soft"), 3, "failed: soft\n"),
        (DeckError(Place("deck", 3), "wrong"), 2, "error: deck, line 3: wrong\n"),
        (OSError("no\ndisc"), 2, "error: no disc\n"),
    ],
)
def test_how_the_command_ends(
    error: Exception,
    code: int,
    words: str,
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def run(*_: object) -> None:
        raise error

    monkeypatch.setattr("tyrecal_solvers.bundled.__main__.run", run)
    assert main([str(folder / "modes")]) == code
    assert capsys.readouterr().err == words


def test_words_of_steps_and_footprints() -> None:
    mode = lambda n, f: {"n": n, "frequency_Hz": f}
    step = {
        "step": 2,
        "pressure_Pa": 240e3,
        "mass_kg": 12.804,
        "modes": [mode(2, 73.116), mode(0, 36.7), mode(2, 88.2)],
    }
    pressed = {"load_N": 4000.0, "deflection_m": 0.020344, "contact_area_m2": 0.018216}
    assert _words({"steps": [step]}) == [
        "step 2: 240 kPa, 12.80 kg",
        "  harmonic 0: 36.70 Hz",
        "  harmonic 2: 73.12, 88.20 Hz",
    ]
    assert _words({"footprints": [pressed], "failure": "no more"}) == [
        "4000 N: deflection 20.34 mm, contact area 182.2 cm²",
        "no more",
    ]
    assert _words({"footprints": [], "failure": ""}) == []


def test_a_request_that_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "modes.request.json").mkdir()
    with pytest.raises(ValueError, match="is not a regular file"):
        read_request(tmp_path / "modes.request.json", ["modes"])
    assert read_request(tmp_path / "none", ["modes"]) == Request()


def test_the_command_says_what_it_found(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "modes.request.json").write_text('{"harmonics": [2], "modes_per_harmonic": 1}')
    assert main([str(folder / "modes"), "--oldjob", "inflate.inp"]) == 0
    output = capsys.readouterr().out
    (mode,) = json.loads((folder / "modes.json").read_text())["steps"][-1]["modes"]
    assert f"harmonic 2: {mode['frequency_Hz']:.2f} Hz\n" in output and "240 kPa" in output
    assert f"results in {folder / 'modes.json'} and {folder / 'modes.npz'}" in output
    assert main([str(folder / "modes")]) == 2
    deck = (folder / "modes.inp").read_text().splitlines()
    (line,) = (i for i, text in enumerate(deck, 1) if text.startswith("*SYMMETRIC MODEL"))
    words = f"line {line}: this job revolves a section job: name that with --oldjob"
    assert words in capsys.readouterr().err


def test_ctrl_c_has_no_traceback(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def run(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tyrecal_solvers.bundled.__main__.run", run)
    assert main([str(folder / "modes")]) == 130
    assert capsys.readouterr().err == "interrupted\n"


RELEASED = "*BOUNDARY, OP=NEW\n"
SPRING_ON = "*ELEMENT, TYPE=SPRING1, ELSET=K\n999000009, 900001\n*SPRING, ELSET=K\n"


@pytest.mark.parametrize(
    ("effects", "old", "new", "words"),
    [
        (PLAIN, "*SYMMETRIC RESULTS TRANSFER, STEP=1, INC=10\n", "", "needs *SYMMETRIC RESULTS"),
        (PLAIN, "*FREQUENCY", "*STATIC\n1., 1.\n*FREQUENCY", "needs one *STATIC, *FREQ"),
        (
            PLAIN,
            "CAVITY, P, 160000\n*END STEP\n*STEP, NAME=MODES\n",
            "CAVITY, P, 160000\n*END STEP\n*STEP, NAME=MODES, PERTURBATION\n*STATIC\n",
            "needs one",
        ),
        (PLAIN, "DIRECT\n0.1, 1.0\n", "DIRECT\n0.1, 1.0\n0.1, 1.0\n", "takes one data line"),
        (PLAIN, STEP, f"*BOUNDARY\nNOWHERE, 1\n{STEP}", "node set NOWHERE is not defined"),
        (PLAIN, STEP, f"*BOUNDARY\n77, 1\n{STEP}", "node set 77 is not defined"),
        (PLAIN, STEP, f"*BOUNDARY\nCROWN, 2, 2, 0.1\n{STEP}", "only zero displacements"),
        (PLAIN, STEP, f"*BOUNDARY\nCROWN, 4, 6\n{STEP}", "freedom 4 to 6 of a set cannot"),
        (PLAIN, STEP, f"*BOUNDARY\nCROWN, 1\n{STEP}", "freedom 1 to 1 of a set cannot"),
        (PLAIN, "TIE NSET=RIM\n*STEP", "TIE NSET=BEAD\n*STEP", "it must be restated"),
        (
            PLAIN,
            "REF NODE=900001, TIE NSET=RIM\n*SOLID",
            "REF NODE=5, TIE NSET=RIM\n*SOLID",
            "node 5 or node set RIM is not defined",
        ),
        (
            PLAIN,
            "*END STEP\n*STEP, NAME=MODES\n*FREQUENCY",
            "*END STEP\n*STEP, NAME=MODES\n*COMPLEX FREQUENCY",
            "not honoured",
        ),
        (PLAIN, FREQUENCY, "*COMPLEX FREQUENCY\n20\n", "no ROTDYNF"),
        (TURNING, "CENTRIF, 25", "CENTRIF, 26", "must be one for all elements"),
        (TURNING, "ROTDYNF, 5,", "ROTDYNF, 6,", "must be one for all elements"),
        (TURNING, "SOLID_1, CENTRIF, 25, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0\n", "", "is left out of"),
        (TURNING, "PLY, CENTRIF", "PLIES, CENTRIF", "element set PLIES of the step's *DLOAD"),
        (TURNING, "PLY, CENTRIF", "PLY, GRAV", "the load 'GRAV' is not"),
        (TURNING, "25, 0.0, 0.0, 0.0, 0.0, 1.0", "25, 0.0, 0.0, 0.0, 1.0, 0.0", "about its axle"),
        (WHEEL, "999000001, 900001", "999000001, 5", "node 5 is no node of the tyre"),
        (WHEEL, "*MASS, ELSET=WHEEL_MASS", "*MASS, ELSET=WHEEL_INERTIA", "no set of MASS"),
        (WHEEL, "0.18, 0.2866666666667, 0.18", "0.18, 0.28, 0.19", "body of revolution"),
        (WHEEL, RELEASED, f"{RELEASED}900001, 1\n", "are free together"),
        (WHEEL, "WELL, P, 160000\n", "", "which is free along the axle"),
        (WHEEL, "REFERENCE\n900001, 0, 0\n", "REFERENCE\n900001, 0.1, 0\n", "must be on the axle"),
        (WHEEL, STEP, f"{SPRING_ON}1\n{STEP}", "*SPRING takes two lines"),
        (WHEEL, STEP, f"{SPRING_ON}1\n1E6\n{STEP}", "degrees of freedom (1, 3) of the rim"),
        (WHEEL, STEP, f"{SPRING_ON}2\n-1E6\n{STEP}", "are not negative"),
        (WHEEL, STEP, f"{SPRING_ON}7\n1E6\n{STEP}", "degrees of freedom 1 to 6"),
        (MASS, "ELSET=POINT_MASS\n0.1", "ELSET=POINT_MASS\n-0.1", "*MASS must be positive"),
        (MASS, "ELSET=POINT_MASS\n0.1", "ELSET=POINT_MASS\n0.1\n0.1", "*MASS takes 1 data line"),
    ],
)
def test_a_pair_that_means_something_else_is_refused(
    effects: tuple[tuple[str, float], ...], old: str, new: str, words: str
) -> None:
    with pytest.raises(DeckError) as error:
        run(effects, (old, new))
    assert words in str(error.value)


SECTION_ROWS = "*STATIC, LONG TERM, DIRECT\n0.1, 1.0\n*BOUNDARY\n900001, 1, 6\n"
LAW = "*VISCOELASTIC, FREQUENCY=TABULAR\n"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("STEP=1, INC=10", "STEP=2, INC=10", "ends with STEP=1, INC=10"),
        ("STEP=1, INC=10", "STEP=1, INC=9", "ends with STEP=1, INC=10"),
        ("DIRECT\n0.1, 1.0", "DIRECT\n0.3, 1.0", "ends with STEP=1, INC=4"),
        ("DIRECT\n0.1, 1.0", "DIRECT\n0.1, 1.05", "ends with STEP=1, INC=11"),
        ("LONG TERM, DIRECT", "LONG TERM", "must be fixed (DIRECT)"),
        ("360.0, 60", "359.9, 60", "revolved by 360 degrees"),
        ("360.0, 60", "180.0, 30, 1.0, G\n180.1, 30", "revolved by 360 degrees"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.1, 0.0, 0.0, 0.0, 1.0, 0.0", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.1, 1.0, 0.0", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.0, 1.0, 0.1", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.0, 0.0, 0.0", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.0, -1.0, 0.0", "about the second axis"),
        (SECTION_ROWS, f"*FREQUENCY\n3\n{SECTION_ROWS[41:]}".replace("0.1, 1.0\n", ""), "one step"),
        ("INFLATE, NLGEOM=YES", "INFLATE", "needs NLGEOM=YES"),
        ("INFLATE, NLGEOM=YES", "INFLATE, NLGEOM=YES, PERTURBATION", "no linear PERTURBATION"),
        ("CAVITY, P, 160000\n*END STEP\n*STEP", "CAVITY, HP, 160000\n*END STEP\n*STEP", "only P"),
        (
            "900001, 1, 6\n*DSLOAD\nCAVITY, P, 160000\n*END STEP\n*STEP",
            "900001, 1, 5\n*DSLOAD\nCAVITY, P, 160000\n*END STEP\n*STEP",
            "must be held in 1, 6",
        ),
        ("*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n", f"{LAW}0., 0.3, 0., 0., 10.\n", "two rows"),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 0.3, 0., 0., 10.\n0., 0.2, 0., 0., 10.\n",
            "their frequencies rise",
        ),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 0.3, 0., 0., 0.\n0., 0.2, 0., 0., 10.\n",
            "their frequencies rise",
        ),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 1.0, 0., 0., 1.\n0., 0.2, 0., 0., 10.\n",
            "are positive",
        ),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 0.3, 0., 0.1, 1.\n0., 0.2, 0., 0., 10.\n",
            "the bulk modulus stays",
        ),
        ("0.3, 0, 0.1\n", "0.3, 0, 0.1, 0.2\n", "data '0.2' is not honoured"),
    ],
)
def test_what_a_transfer_or_a_table_may_not_be(old: str, new: str, words: str) -> None:
    """Read alone, without a solution: what stands there would mean another state."""
    with pytest.raises(DeckError, match=re.escape(words)):
        run(PLAIN, (old, new))


def test_a_revolve_job_alone_is_refused() -> None:
    pair = dict(texts(PLAIN))
    with pytest.raises(DeckError, match="name that with --oldjob"):
        Deck({"modes": pair["modes"]}, "modes", None)
