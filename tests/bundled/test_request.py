"""The side file of a job: whatever is wrong in it is told with its key; what the command says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from tyrecal_solvers.bundled.__main__ import _words, main
from tyrecal_solvers.bundled.deck.request import Request, read_request
from tyrecal_solvers.errors import Refused, RunFailed
from tyrecal_solvers.language.text import DeckError, Place

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.case import with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES

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
