"""The whole path, case to frequencies, against an independent implementation's figures.

Constants of the case at work: moduli, Prony terms, second invariant, elements, sub-regions.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.find import match
from tyrecal.simulate.modes.label import Label, label_modes
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..conftest import CASES, ROOT

REFERENCE = json.loads((ROOT / "tests/data/reference.json").read_text())
POINTS = [(name, i) for name, points in REFERENCE["sections"].items() for i in range(len(points))]
VARIABLES = ("A_belt", "A_carcass", "C10")


def label(text: str) -> Label:
    c, m, *kind = text.split(",")
    return Label(int(c), int(m), kind[0] if kind else None)


def evaluate(name: str, point: dict, level: str, gradients: tuple[str, ...] = ()):
    """Evaluation and its modes by label at a reference point."""
    case = with_level(load_case(CASES / f"{name}.yaml"), level)
    case = with_values(case, {"pressure_kPa": point["pressure_kPa"]})
    values = {v: point[v] for v in VARIABLES}
    evaluation = Evaluator(TyreDesign(case)).evaluate(Question(values, gradients))
    return evaluation, match(label_modes(evaluation.modes), [label(k) for k in point["modes"]])


@pytest.mark.parametrize(
    ("name", "i"),
    [pytest.param(*each, marks=[pytest.mark.slow] * bool(k % 3)) for k, each in enumerate(POINTS)],
)
def test_frequencies_at_the_default_mesh(name: str, i: int) -> None:
    """Within 0.2 % (0.5 % asked for)."""
    point = REFERENCE["sections"][name][i]
    evaluation, modes = evaluate(name, point, "default")
    assert evaluation.mass_kg == pytest.approx(point["mass_kg"], rel=1e-3)
    for key, frequency in point["modes"].items():
        assert modes[label(key)].frequency_Hz == pytest.approx(frequency, rel=2e-3), key


@pytest.mark.slow
@pytest.mark.parametrize(("name", "i"), POINTS[::5])
def test_frequencies_at_the_refined_mesh(name: str, i: int) -> None:
    """Within 0.2 %."""
    point = REFERENCE["sections"][name][i]
    _, modes = evaluate(name, point, "refined")
    for key, frequency in point["modes"].items():
        assert modes[label(key)].frequency_Hz == pytest.approx(frequency, rel=2e-3), key


@pytest.mark.parametrize(("i", "where"), [(0, "initial"), (1, "optimised")])
def test_derivatives(i: int, where: str) -> None:
    """Within 1 % of the largest derivative of the mode, Hz per unit of ln(variable)."""
    known = REFERENCE["derivatives_Hz_per_ln"]
    point = REFERENCE["sections"][known["section"]][i]
    evaluation, modes = evaluate(known["section"], point, "default", VARIABLES)
    for key, expected in known[where].items():
        largest = max(abs(x) for x in expected.values())
        for variable in VARIABLES:
            slope = evaluation.gradients[variable][modes[label(key)].position] * point[variable]
            assert abs(slope - expected[variable]) <= 0.01 * largest, (key, variable)


@pytest.mark.parametrize(
    "path",
    [
        "A_belt",
        "A_carcass",
        "C10",
        "materials.rubber.C01_Pa",
        "materials.rubber.D1_per_Pa",
        "materials.rubber.density_kg_per_m3",
        "materials.belt_cord.youngs_modulus_Pa",
        "rebar_layers.belt_1.angle_deg",
        "rebar_layers.carcass.spacing_m",
        "pressure_kPa",
        "materials.rubber.prony.0.g",
    ],
)
@pytest.mark.parametrize("vibration_Hz", [None, pytest.param(50.0, marks=pytest.mark.slow)])
def test_any_number_of_the_case_has_an_exact_derivative(
    path: str, vibration_Hz: float | None
) -> None:
    """Against fourth-order central differences: within 1e-5 of the largest of all modes."""
    case = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
    if vibration_Hz is not None:
        case = with_values(case, {"analysis.vibration_frequency_Hz": vibration_Hz})
    case = with_values(case, start_values(case))
    if path in case.case.variables:
        value = case.case.variables[path].start
    else:
        value = {
            "materials.rubber.C01_Pa": 1e5,
            "rebar_layers.belt_1.angle_deg": 70.0,
            "materials.rubber.prony.0.g": 0.3,
        }.get(path) or _number(case, path)
    evaluator = Evaluator(TyreDesign(case))

    def frequencies(x: float) -> np.ndarray:
        evaluation = evaluator.evaluate(Question({path: x}))
        return np.array([m.frequency_Hz for m in evaluation.modes])

    h = 2e-3 * value
    near, far = (
        (frequencies(value + k * h) - frequencies(value - k * h)) / (2 * k * h) for k in (1, 2)
    )
    difference = (4 * near - far) / 3
    exact = evaluator.evaluate(Question({path: value}, (path,))).gradients[path]
    assert np.max(abs(exact - difference)) <= 1e-5 * np.max(abs(exact)) + 1e-12


def _number(case, path: str) -> float:
    part = case.case
    for name in path.split("."):
        part = part[name] if isinstance(part, dict) else getattr(part, name)
    return float(part)


CASE = load_case(CASES / "p235_75r17.yaml")


def frequencies(case: LoadedCase, **values: float) -> dict[str, float]:
    modes = label_modes(Evaluator(TyreDesign(case)).evaluate(Question(values)).modes)
    return {str(mode.label): mode.frequency_Hz for mode in modes}


def edited(folder: Path, *changes: tuple[str, str]) -> LoadedCase:
    path = folder / "p235_75r17.yaml"
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return load_case(path)


def test_sudden_inflation_stiffens_by_the_prony_series(case_folder: Path) -> None:
    """Instantaneous moduli are the relaxed ones over 1 - g, g = 0.3."""
    sudden = edited(case_folder, ("static_moduli: long_term", "static_moduli: instantaneous"))
    assert frequencies(sudden, C10=0.7e6) == pytest.approx(frequencies(CASE, C10=1e6), rel=1e-9)


def test_moduli_given_as_instantaneous(case_folder: Path) -> None:
    given = edited(case_folder, ("    moduli: long_term", "    moduli: instantaneous"))
    assert frequencies(given, C10=1e6 / 0.7) == pytest.approx(frequencies(CASE, C10=1e6), rel=1e-9)


@pytest.mark.slow
def test_vibration_modulus_between_relaxed_and_instantaneous(case_folder: Path) -> None:
    """tau = 0.1 s: hardly stiffer at 0.1 Hz, almost instantaneous at 100 Hz."""
    slow, fast = (
        frequencies(
            edited(
                case_folder, ("vibration_frequency_Hz: " + old, "vibration_frequency_Hz: " + new)
            )
        )
        for old, new in (("null", "0.1"), ("0.1", "100.0"))
    )
    plain = frequencies(CASE)
    for label, frequency in plain.items():
        assert frequency < slow[label] < 1.01 * frequency
        assert slow[label] < fast[label] < 1.2 * frequency
    # wind-up is governed by rubber shear: sqrt(1 / 0.7) = 1.195 at most
    assert fast["[0,0] torsional"] > 1.05 * plain["[0,0] torsional"]


def test_second_invariant_counts() -> None:
    """C10 and C01 act alike at small strain; in the inflated sidewall they differ a little."""
    half = {"materials.rubber.C10_Pa": 5e5, "materials.rubber.C01_Pa": 5e5}
    mixed, plain = frequencies(CASE, **half), frequencies(CASE, C10=1e6)
    ratios = np.array([mixed[k] / plain[k] for k in plain])
    assert np.all(abs(ratios - 1) < 0.01)
    assert np.any(abs(ratios - 1) > 1e-4)


@pytest.mark.slow
def test_angular_spacing_fans_the_cords_out(case_folder: Path) -> None:
    """Constant degrees between cords that equal the constant spacing at r = 0.35 m."""
    spacing = np.degrees(1e-3 / 0.35)
    fanned = edited(
        case_folder,
        (
            "spacing_m: 1.0e-3, angle_deg: 0.0",
            f"geometry: angular, spacing_deg: {spacing:.12g}, angle_deg: 0.0",
        ),
        ("rebar_layers.carcass.spacing_m", "rebar_layers.carcass.spacing_deg"),
    )
    assert frequencies(fanned) != pytest.approx(frequencies(CASE), rel=1e-4)
    assert frequencies(fanned) == pytest.approx(frequencies(CASE), rel=0.05)


@pytest.mark.slow
def test_a_region_and_a_gap_can_have_their_own_rubber(case_folder: Path) -> None:
    """The same rubber under another name changes nothing; a heavy tread lowers everything."""
    text = (case_folder / "p235_75r17.yaml").read_text()
    block = text[text.index("  rubber:\n") : text.index("  belt_cord:\n")]
    case = edited(
        case_folder,
        ("  belt_cord:\n", block.replace("  rubber:", "  tread:") + "  belt_cord:\n"),
        (
            "  - {material: rubber}",
            "  - {material: rubber}\n"
            "  - {material: tread, regions: [crown], between: [belt2, outer]}",
        ),
    )
    assert frequencies(case) == pytest.approx(frequencies(CASE), rel=1e-9)
    heavy = frequencies(case, **{"materials.tread.density_kg_per_m3": 1400.0})
    assert all(heavy[k] < f for k, f in frequencies(CASE).items())


def test_the_papers_elements(case_folder: Path) -> None:
    """CGAX4R with SFMGAX1 on the refined mesh: within 1.5 % of the quadratic elements."""
    linear = edited(
        case_folder, ("element: CGAX8R", "element: CGAX4R"), ("level: default", "level: refined")
    )
    assert frequencies(linear) == pytest.approx(frequencies(CASE), rel=0.015)


def test_no_pressure_no_strain() -> None:
    """A tyre at rest does not move, and still has modes."""
    case = replace(CASE, case=CASE.case.model_copy(update={"pressure_kPa": 0.0}))
    answer = Evaluator(TyreDesign(case)).evaluate(Question({}))
    assert abs(answer.displacement).max() < 1e-12
    assert min(mode.frequency_Hz for mode in answer.modes) > 1.0


@pytest.mark.slow
def test_an_honest_failure_tells_the_pressure_that_was_reached(tmp_path: Path) -> None:
    case = replace(CASE, case=CASE.case.model_copy(update={"pressure_kPa": 1900.0}))
    with pytest.raises(EvaluationFailed, match=r"inflation stopped at \d.* of 1900 kPa") as failure:
        Evaluator(TyreDesign(case), folder=tmp_path / "runs").evaluate(
            Question({"A_carcass": 1e-8, "C10": 1e5})
        )
    assert failure.value.cause == "no_equilibrium"
    assert failure.value.folder is not None and (failure.value.folder / "modes.inp").exists()


@pytest.mark.slow
def test_answers_in_order_from_a_process_pool() -> None:
    questions = [Question({"A_belt": a}) for a in (2e-7, 3e-7, 4e-7)]
    questions.insert(1, Question({"A_carcass": 1e-8, "C10": 1e5, "pressure_kPa": 1900.0}))
    alone, pooled = (
        list(Evaluator(TyreDesign(CASE)).evaluate_all(questions, jobs)) for jobs in (1, 2)
    )
    for one, other in zip(alone, pooled, strict=True):
        assert type(one) is type(other)
        if isinstance(one, EvaluationFailed):
            assert str(one) == str(other)
        else:
            assert [m.frequency_Hz for m in one.modes] == [m.frequency_Hz for m in other.modes]
