"""Response functions for the command, Python and a batch: directions, files, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tyrecal
from tyrecal.cli.main import main
from tyrecal.errors import InputError
from tyrecal.measured.universal import read_universal
from tyrecal.report.response import draw_responses
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.studies.response import FrfResult, response_request
from tyrecal.studies.response_points import read_points
from tyrecal.studies.result import StudyInput
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.parts import Spindle

from ..conftest import CASES

Array = np.ndarray
CASE_FILE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
PATCH_MM, RADIUS_m = 100.0, 0.3927
FORCES = "tread:0deg:radial,tread:90deg:radial,tread:0deg:tangential,tread:0deg:lateral"
BAND = {"from_Hz": 0.0, "to_Hz": 100.0, "step_Hz": 2.0, "patch_mm": PATCH_MM}


@pytest.fixture(scope="module")
def case() -> LoadedCase:
    """The example, its rubber with a loss factor."""
    case = tyrecal.load_case(CASE_FILE, mesh="coarse")
    rubber = case.case.materials["rubber"].model_copy(update={"loss_factor": 0.2})
    materials = {**case.case.materials, "rubber": rubber}
    return replace(case, case=case.case.model_copy(update={"materials": materials}))


@pytest.fixture(scope="module")
def responses(case: LoadedCase) -> FrfResult:
    given = StudyInput(case, Evaluator(TyreDesign(case)), {"initial": start_values(case)})
    points = "tread:0deg:radial,tread:90deg:radial,tread:0deg:lateral,tread:0deg:tangential"
    hub = ",".join(f"hub:{name}" for name in ("fx", "fy", "fz", "mx", "my", "mz"))
    return FrfResult.run(given, excite=points, respond=f"{hub},{points}", **BAND)


def function(result: FrfResult, respond: str, excite: str) -> Array:
    """A function of frequency (f,)."""
    (each,) = (x for x in result.functions if (x.respond, x.excite) == (respond, excite))
    return each.values


def test_statically_the_hub_bears_the_force(responses: FrfResult) -> None:
    """Outwards below the hub is down, outwards behind it backwards; along the axle it has a moment
    about the fore-aft axis, and backwards below one about the axle."""
    b = PATCH_MM / 2e3 / responses.radius_m
    share, arm = np.sin(b) / b, responses.radius_m
    assert responses.radius_m == pytest.approx(RADIUS_m, rel=0.01)
    expected = {
        "tread:0deg:radial": [0, 0, -share, 0, 0, 0],
        "tread:90deg:radial": [-share, 0, 0, 0, 0, 0],
        "tread:0deg:lateral": [0, 1, 0, arm * share, 0, 0],
        "tread:0deg:tangential": [-share, 0, 0, 0, arm, 0],
    }
    for excite, forces in expected.items():
        names = ("fx", "fy", "fz", "mx", "my", "mz")
        static = [function(responses, f"hub:{name}", excite)[0] for name in names]
        assert static == pytest.approx(forces, abs=1e-4)


def test_a_quarter_turn_and_reciprocity(responses: FrfResult) -> None:
    below = function(responses, "hub:fz", "tread:0deg:radial")
    behind = function(responses, "hub:fx", "tread:90deg:radial")
    np.testing.assert_allclose(below, behind, rtol=1e-9)
    there = function(responses, "tread:90deg:radial", "tread:0deg:radial")
    back = function(responses, "tread:0deg:radial", "tread:90deg:radial")
    np.testing.assert_allclose(there, back, rtol=0, atol=1e-9 * abs(there).max())
    assert not function(responses, "hub:fy", "tread:0deg:radial").any()
    peaks = responses.quantities()
    assert peaks["peak_Hz hub:fz tread:0deg:radial"] == pytest.approx(66.5, abs=1.5)
    assert peaks["peak hub:fz tread:0deg:radial"] == pytest.approx(1 / (2 * 0.0215), rel=0.15)


def on_rim(case: LoadedCase, **rim: object) -> LoadedCase:
    """The example on another rim."""
    own = case.case.rim.model_copy(update=rim)
    return replace(case, case=case.case.model_copy(update={"rim": own}))


def accelerances(
    case: LoadedCase, respond: str, from_Hz: float = 0.2, step_Hz: float = 60.0, steps: int = 1
) -> FrfResult:
    """Accelerances by forces on the tread, with waves up to 4."""
    given = StudyInput(case, Evaluator(TyreDesign(case)), {"initial": start_values(case)})
    band = {"from_Hz": from_Hz, "to_Hz": from_Hz + steps * step_Hz, "step_Hz": step_Hz}
    options = {"excite": FORCES, "respond": respond, "patch_mm": 200.0, "form": "accelerance"}
    return FrfResult.run(given, **band, **options)


@pytest.mark.slow
def test_a_free_wheel_moves_as_a_rigid_body_at_low_frequencies(case: LoadedCase) -> None:
    """Its accelerance is 1 / (mass of tyre and wheel), times the share of the patch's force that
    moves the whole; it is reciprocal."""
    free = accelerances(on_rim(case, free=True), f"hub:x,hub:y,hub:z,{FORCES}")
    evaluation = Evaluator(TyreDesign(case)).evaluate(Question({}))
    mass = evaluation.mass_kg + case.case.rim.mass_kg
    b = 0.1 / free.radius_m
    share = np.sin(b) / b
    low = lambda respond, excite: function(free, respond, excite)[0].real
    assert low("hub:z", "tread:0deg:radial") == pytest.approx(-share / mass, rel=1e-4)
    assert low("hub:x", "tread:90deg:radial") == pytest.approx(-share / mass, rel=1e-4)
    assert low("hub:x", "tread:0deg:tangential") == pytest.approx(-share / mass, rel=1e-4)
    assert low("hub:y", "tread:0deg:lateral") == pytest.approx(1 / mass, rel=1e-4)
    assert free.wheel == "free" and "no force on the hub is blocked" in free.sentences()[0]
    there = function(free, "tread:90deg:radial", "tread:0deg:lateral")
    back = function(free, "tread:0deg:lateral", "tread:90deg:radial")
    size = np.abs(function(free, "tread:0deg:radial", "tread:0deg:radial"))
    np.testing.assert_allclose(there, back, rtol=0, atol=1e-9 * size.max())
    one = function(free, "tread:0deg:tangential", "tread:90deg:radial")
    other = function(free, "tread:90deg:radial", "tread:0deg:tangential")
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * size.max())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "respond", "excite"),
    [("[1,0]", "hub:z", "tread:0deg:radial"), ("[1,1]", "hub:rx", "tread:0deg:lateral")],
)
def test_a_free_wheel_resonates_at_its_modes(
    case: LoadedCase, label: str, respond: str, excite: str
) -> None:
    """Half the bandwidth away from a mode, the response falls by the square root of 2, within what
    other modes add."""
    free = on_rim(case, free=True)
    modes = paired_labels(Evaluator(TyreDesign(free)).evaluate(Question({})).modes)
    (mode,) = (each for each in modes if str(each.label) == label)
    f, ratio = mode.frequency_Hz, mode.raw.damping_ratio
    assert ratio
    result = accelerances(free, respond, f * (1 - ratio), f * ratio, steps=2)
    values = np.abs(function(result, respond, excite))
    assert values[[0, 2]] / values[1] == pytest.approx(2**-0.5, rel=0.1)


@pytest.mark.slow
def test_on_very_stiff_springs_the_rim_is_held(case: LoadedCase) -> None:
    stiffest = Spindle(**dict.fromkeys(Spindle.model_fields, 1e-14))
    held, stiff = (accelerances(each, FORCES) for each in (case, on_rim(case, spindle=stiffest)))
    assert stiff.wheel == "springs" and held.wheel == "held"
    for each in held.functions:
        other = function(stiff, each.respond, each.excite)
        np.testing.assert_allclose(other, each.values, rtol=1e-6, atol=1e-9 * each.peak)


def test_the_universal_file_reads_back(
    responses: FrfResult, case: LoadedCase, tmp_path: Path
) -> None:
    """Functions, nodes and directions; the hub's are forces, in sets with 9 over 13."""
    path = tmp_path / "frf.uff"
    path.write_text(responses.texts()["frf.uff"])
    file = read_universal(path)
    assert set(file.nodes) == {1, 101, 102}
    assert file.nodes[101] == pytest.approx((0, 0, -responses.radius_m))
    assert file.nodes[102] == pytest.approx((-responses.radius_m, 0, 0), abs=1e-12)
    assert file.axes[101] == pytest.approx(np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]]))
    assert sum(file.skipped.values()) == 24 and len(file.functions) == 16
    first = file.functions[0]
    assert (first.response, first.reference, first.form) == ((101, 1), (101, 1), "receptance")
    assert first.frequency_Hz == pytest.approx(responses.frequency_Hz)
    written = function(responses, "tread:0deg:radial", "tread:0deg:radial")
    np.testing.assert_allclose(first.values, written, rtol=1e-11)
    lines = path.read_text().splitlines()
    assert lines[0] == "    -1" and max(map(len, lines)) <= 80


@pytest.mark.slow
def test_its_own_file_as_the_measured_one(
    responses: FrfResult, case: LoadedCase, tmp_path: Path
) -> None:
    """The same functions at the same frequencies above 0; those that are 0 have no FRAC."""
    path = tmp_path / "frf.uff"
    path.write_text(responses.texts()["frf.uff"])
    given = StudyInput(case, Evaluator(TyreDesign(case)), {"initial": start_values(case)})
    result = FrfResult.run(given, measured=path, to_Hz=90.0, patch_mm=PATCH_MM)
    assert len(result.functions) == 40 and result.frequency_Hz == responses.frequency_Hz[1:46]
    known = [each for each in result.functions if each.frac is not None]
    assert 10 < len(known) < 40
    for each in known:
        assert (each.frac, each.level_dB) == pytest.approx((1.0, 0.0), abs=1e-4)
    assert "functions were measured: FRAC 1.000" in result.sentences()[-1]
    assert result.provenance and result.provenance.measured_sha256
    assert len(draw_responses(result)["frf"].axes) == 6


def test_points_that_no_measured_function_has_are_refused(
    responses: FrfResult, case: LoadedCase, tmp_path: Path
) -> None:
    path = tmp_path / "frf.uff"
    path.write_text(responses.texts()["frf.uff"])
    given = StudyInput(case, Evaluator(TyreDesign(case)), {"initial": start_values(case)})
    with pytest.raises(InputError, match="no function in it is of tread:45deg:radial and hub:fx"):
        FrfResult.run(given, measured=path, excite="tread:45deg:radial", respond="hub:fx")


def test_tables_and_pictures(responses: FrfResult) -> None:
    (table,) = responses.tables()
    assert len(table.rows) == len(responses.functions) == 40
    rows = responses.csv().splitlines()
    assert rows[0] == "excite,respond,quantity,unit,frequency_Hz,real,imag"
    assert len(rows) == 1 + 40 * len(responses.frequency_Hz) and len(responses.frequency_Hz) == 51
    assert len(draw_responses(responses)["frf"].axes) == 6
    assert not responses.sentences()
    again = FrfResult.model_validate_json(responses.texts()["frf.json"])
    assert again.functions[0].values == pytest.approx(responses.functions[0].values)


def test_the_command_and_accelerance(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without a loss factor the peaks are said to mean nothing."""
    out = tmp_path / "out"
    words = f"--mesh coarse --to-Hz 60 --step-Hz 20 --patch-mm 200 --no-pictures --output {out}"
    points = "--excite tread:0deg:radial --respond tread:0deg:radial"
    functions = {}
    for form in ("receptance", "accelerance"):
        with pytest.raises(SystemExit) as ended:
            main(["frf", str(CASE_FILE), *words.split(), *points.split(), "--form", form])
        assert ended.value.code == 0
        (functions[form],) = json.loads((out / "frf.json").read_text())["functions"]
    assert "no compound has a loss factor" in capsys.readouterr().out
    assert {path.name for path in out.glob("frf.*")} == {"frf.json", "frf.csv", "frf.uff"}
    omega = 2 * np.pi * np.array([0.0, 20.0, 40.0, 60.0])
    scaled = -(omega**2) * functions["receptance"]["real"]
    assert functions["accelerance"]["real"] == pytest.approx(scaled)
    assert functions["accelerance"]["unit"] == "m/s²/N"
    before = (out / "frf.csv").read_bytes()
    with pytest.raises(SystemExit) as ended:
        main(
            [
                "frf",
                str(CASE_FILE),
                *words.split()[:4],
                *words.split()[6:],
                "--measured",
                f"{out}/frf.csv",
            ]
        )
    assert ended.value.code == 2 and (out / "frf.csv").read_bytes() == before
    assert "frf.csv' is read, a result would replace it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "hub", "words"),
    [
        ("tread:0:radial", True, "'tread:0:radial' is no point: give tread:ANGLEdeg:DIRECTION"),
        ("hub:fq", True, "hub:fz with one of fx, fy"),
        ("hub:fz", False, "'hub:fz' is no point"),
        ("hub:fz,hub:fz", True, "has a point twice"),
        ("", True, "'' is no point"),
    ],
)
def test_points_that_are_refused(text: str, hub: bool, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_points(text, hub)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"step_Hz": 0.7}, "whole number of steps"),
        ({"step_Hz": 0.0}, "whole number of steps"),
        ({"from_Hz": 200.0}, "frequencies from 200 to 100 Hz"),
        ({"step_Hz": 0.001}, "more than 5000 frequencies"),
        ({"patch_mm": 0.0}, "patch 0 mm: must be from 1 to 200 mm"),
    ],
)
def test_requests_that_are_refused(change: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        response_request("tread:0deg:radial", "hub:fz", **{**BAND, **change})


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("rim.free=true --load-N 4000", "a rim that moves"),
        (
            "rim.free=true --respond hub:fz",
            "or hub:z with one of x, y, z, rx, ry, rz (the wheel moves)",
        ),
        ("splice.share=0.01", "couples harmonics"),
    ],
)
def test_tyres_that_are_refused_before_anything_runs(
    setting: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["--set", *setting.split(), "--output", str(tmp_path / "out")]
    with pytest.raises(SystemExit) as leave:
        main(["frf", str(CASES / "p235_75r17.yaml"), "--mesh", "coarse", *out])
    assert leave.value.code == 2
    assert words in capsys.readouterr().err and not (tmp_path / "out").exists()
