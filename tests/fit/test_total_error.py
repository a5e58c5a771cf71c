"""The total standard error of a fitted variable: by its formula, and by fits to other tyres."""

from __future__ import annotations

import numpy as np
import pytest

import tyrecal
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.find import LabelledModes, find_modes
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.road import press
from tyrecal.studies.fit.road_errors import road_changes
from tyrecal.studies.fit.targets import ValueTarget, read_targets
from tyrecal.studies.fit.total_error import BY_SECTION, TotalError, total_error
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.studies.inference.section_fields import fields, with_fields
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.schema import Uncertainty
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.state import TyreState

from ..calibrated import calibrate
from ..conftest import CASES
from .known_truth import CASE, evaluator

DENSITY, ANGLE = "materials.rubber.density_kg_per_m3", "rebar_layers.belt_1.angle_deg"
SIGMA = 1e-3  # relative


def coarse(known_from: str, stated: dict[str, Uncertainty]) -> LoadedCase:
    """The paper's tyre, coarse, at which its own frequencies are the targets."""
    case = tyrecal.load_case(CASES / "p235_75r17.yaml", mesh="coarse")
    section = with_part(case.case.section, known_from=known_from)
    case = changed(case, section=section, uncertainties=stated)
    hertz = frequencies(case, {})
    modes = [
        t.model_copy(update={"frequency_Hz": f, "sigma_Hz": SIGMA * f})
        for t, f in zip(case.case.targets.modes, hertz, strict=True)
    ]
    return changed(case, targets=case.case.targets.model_copy(update={"modes": modes}))


def frequencies(case: LoadedCase, numbers: dict[str, float]) -> np.ndarray:
    """Hz of the target modes at the start values with other numbers of the case."""
    labels = [t.label for t in read_targets(case)]
    question = Question({**start_values(case), **numbers})
    ((_, answer),) = find_modes(Evaluator(TyreDesign(case)), [question], lambda *_: labels, 1)
    assert isinstance(answer, LabelledModes)
    return np.array([answer.wanted[label].frequency_Hz for label in labels])


def total_of(case: LoadedCase) -> tuple[Problem, np.ndarray, TotalError]:
    """The problem, scatter (v, v) of its coordinates, and the total error at the start."""
    problem = Problem(case, Evaluator(TyreDesign(case)))
    point = problem.evaluate(problem.start())
    known = uncertainty(problem, point)
    J = point.jacobian
    return problem, np.linalg.inv(J.T @ J), total_error(problem, point, known)


@pytest.mark.slow
def test_a_constant_moves_the_variables_as_a_fit_to_another_tyre() -> None:
    """The belt's angle by one standard deviation: a step of the fit to that tyre's frequencies."""
    angle = Uncertainty(sets=[ANGLE], absolute=0.1)
    case = coarse("exact", {"angle": angle})
    problem, _, total = total_of(case)
    plain = problem.evaluate(problem.start())
    own = case.case.rebar_layers["belt_1"].angle_deg
    other = frequencies(case, {ANGLE: own + 0.1})
    J, scale = plain.jacobian, problem.scale
    wanted = np.array([t.frequency_Hz for t in problem.targets])
    step = np.linalg.lstsq(J, scale * (other - wanted), rcond=None)[0]
    share = total.shares["angle"] * np.diag(total.of_coordinates)
    np.testing.assert_allclose(np.sqrt(share), abs(step), rtol=0.02)


@pytest.mark.slow
def test_the_parts_are_the_whole() -> None:
    """Shares add to 1; a section by its size code adds more than one that is measured."""
    totals = {}
    for origin in ("measured", "size_code"):
        case = coarse(origin, {"density": Uncertainty(sets=[DENSITY], percent=1.5)})
        problem, scatter, total = total_of(case)
        np.testing.assert_allclose(np.sum([*total.shares.values()], 0), 1.0)
        weights = [t.multiplicity for t in problem.targets]
        assert weights != [1] * len(weights)  # so the scatter is no (J^T J)^-1
        totals[origin] = np.diag(total.of_coordinates)
        assert (totals[origin] > 0.5 * np.diag(scatter)).all()
    assert (totals["size_code"] > 4 * totals["measured"]).all()
    assert next(iter(total.shares)) == BY_SECTION


def test_chi2_above_its_freedom_scales_the_total() -> None:
    case = coarse("exact", {"density": Uncertainty(sets=[DENSITY], percent=1.5)})
    problem, _, total = total_of(case)
    point = problem.evaluate(problem.start())
    errors = [
        total.by_variable(problem, point, chi2)["C10"]["standard_error_total"]
        for chi2 in (None, 0.5, 4.0)
    ]
    assert errors[:2] == [errors[0]] * 2
    assert errors[2] == pytest.approx(2 * errors[0])
    # what predictions are made of states the scatter of each target, relative
    assert [each.scatter for each in total.responses] == pytest.approx(
        [SIGMA] * len(problem.targets)
    )


def test_why_it_is_not_known() -> None:
    """A solver without exact sensitivities: the reason is in the result, and no number."""
    fit = calibrate(CASE, evaluator())  # type: ignore[arg-type]
    result = fit.result
    assert all(
        v["standard_error_total"] is None for v in fit.found.model_dump()["variables"].values()
    )
    assert result["total_error_unknown"]
    assert "not known" in fit.found.sentences()[0]


@pytest.mark.slow
def test_changes_on_the_road_are_those_of_other_tyres() -> None:
    """Pressure, the meridian and the stiffness of compounds: stiffness and area of a tyre that has
    a fifth of a standard deviation of each, within 3 % of the change and 1e-4."""
    case = tyrecal.load_case(CASES / "p235_75r17.yaml", mesh="coarse")
    section = with_part(case.case.section, known_from="drawing")
    case = changed(case, section=section)
    names = ("pressure", "section meridian 2", "section stiffness 1")
    known = [source for source in sources(case)[0] if source.name in names]
    assert [source.name for source in known] == list(names)
    state = TyreState(load_N=3000.0)
    targets = [
        ValueTarget(name, 1.0, 0.1, state=state)
        for name in ("vertical_stiffness_N_per_m", "contact_area_m2")
    ]
    values, share = start_values(case), 0.2
    changes = road_changes(case, Evaluator(TyreDesign(case)), targets, values, known)
    kPa = case.case.pressure_kPa + share * known[0].steps["pressure_kPa"]
    none = dict.fromkeys(fields(case), 0.0)
    others = [
        (case, {**values, "pressure_kPa": kPa}),
        *((with_fields(case, {**none, name: share}), {}) for name in names[1:]),
    ]
    (own,) = press(case, Evaluator(TyreDesign(case)), targets, [values], 1)  # at its own values
    for column, (other, there) in zip(changes.T, others, strict=True):
        (pressed,) = press(other, Evaluator(TyreDesign(other)), targets, [there], 1)
        expected = np.log(np.asarray(pressed) / own) / share
        np.testing.assert_allclose(column, expected, rtol=0.03, atol=1e-4)
