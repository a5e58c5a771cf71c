"""Length and width of the contact patch as targets, on a tyre that is pressed by a formula."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.measured.targets import with_measured
from tyrecal.report.diagnosis import _measured
from tyrecal.report.html.comparison import _deviations
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.diagnose.under_load import LoadedRow
from tyrecal.studies.fit.problem import Problem
from tyrecal.tyre.case.schema import TargetFootprint
from tyrecal.tyre.footprint_quantities import FOOTPRINT_QUANTITIES

from ..calibrated import calibrate
from . import pressed
from .pressed import CASE, LENGTH, START, STIFFNESS_0, WIDTH, Elastic, case_with, evaluator, power

TRUTH = {"A_belt": START["A_belt"], "A_carcass": 2.5e-7, "C10": 7e5}
POWERS = {
    "contact_area_m2": pressed.AREA,
    "contact_length_m": LENGTH,
    "contact_width_m": WIDTH,
    "vertical_stiffness_N_per_m": pressed.STIFFNESS,
}
AT_START = dict(zip(POWERS, (pressed.AREA_0, 0.16, 0.10, STIFFNESS_0), strict=True))


def target(name: str) -> TargetFootprint:
    """The quantity that the tyre has at TRUTH, to 2 %."""
    value = AT_START[name] * power(TRUTH, POWERS[name])
    sigma = FOOTPRINT_QUANTITIES[name].sigma
    return TargetFootprint.model_validate({"load_N": 4000, name: value, sigma: 0.02 * value})


class Sloped(Elastic):
    """Gives exact sensitivities by the case's variables."""

    capabilities = Bundled.capabilities

    def write(self, decks: Any, folder: Any) -> Any:
        """The real decks; remembers the design."""
        self.values = decks.values
        return super().write(decks, folder)

    def footprint(self, load: float) -> dict[str, Any]:
        """Footprint of one load, with sensitivities."""
        at_load = super().footprint(load)
        at_load["contact_area_m2"] = float(at_load["area_m2"].sum())
        slopes = {
            variable: {
                each.slope: at_load[each.slope] * POWERS[name][variable] / self.values[variable]
                for name, each in FOOTPRINT_QUANTITIES.items()
            }
            for variable in START
        }
        return at_load | {"slopes": slopes}


def test_length_and_width_find_two_variables() -> None:
    case = case_with([], [target("contact_length_m"), target("contact_width_m")])
    fit = calibrate(case, evaluator(case), fixed={"A_belt": START["A_belt"]})
    assert fit.found.converged
    for name in ("A_carcass", "C10"):
        assert fit.found.variables[name].value == pytest.approx(TRUTH[name], rel=1e-3)
    length, width = fit.found.footprint
    assert (length.quantity, width.quantity) == ("contact_length_m", "contact_width_m")
    assert length.initial == pytest.approx(0.16) and width.initial == pytest.approx(0.10)
    rows = {row[1]: row[2] for row in fit.found.tables()[0].rows}
    assert rows["contact length, mm"] == "160.0" and rows["contact width, mm"] == "100.0"
    assert "contact_length_m" in fit.found.csv()
    assert {aim for _, aim in _deviations(fit.found)} == {"contact length", "contact width"}


@pytest.mark.parametrize("solver", [Elastic, Sloped])
def test_sensitivities_are_those_of_the_formula(solver: type[Elastic]) -> None:
    """Sensitivities are by differences, or from a solver that gives them."""
    case = case_with([], [target(name) for name in POWERS])
    problem = Problem(case, Evaluator(TyreDesign(case), _solver=solver()))
    point = problem.evaluate(np.log(list(TRUTH.values())) + 0.05)
    elasticities = point.jacobian / (problem.scale * point.others)[:, None]
    powers = [[own[name] for name in START] for own in POWERS.values()]
    assert elasticities == pytest.approx(np.array(powers), rel=1e-4, abs=1e-6)


def test_they_come_from_a_table(tmp_path: Any) -> None:
    path = tmp_path / "measured.csv"
    path.write_text(
        "load [N],pressure [kPa],contact length [mm],contact width [mm],sigma [mm]\n"
        "4000,200,132,141,2\n4000,240,126,139,2\n"
    )
    case, left_out = with_measured(CASE, path)
    assert not left_out
    targets = [
        (t.pressure_kPa, t.contact_length_m, t.contact_width_m, t.sigma_m)
        for t in case.case.targets.footprint
    ]
    assert targets == [
        (200, 0.132, None, 0.002),
        (200, None, pytest.approx(0.141), 0.002),
        (None, 0.126, None, 0.002),
        (None, None, 0.139, 0.002),
    ]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("contact_area_m2", 0.02, "contact area 200.0 cm² ± 1.0 %"),
        ("contact_length_m", 0.132, "contact length 132.0 mm ± 1.0 %"),
        ("contact_width_m", 0.141, "contact width 141.0 mm ± 1.0 %"),
        ("vertical_stiffness_N_per_m", 2.1e5, "vertical stiffness 210.0 N/mm ± 1.0 %"),
    ],
)
def test_words_of_a_diagnosis(name: str, value: float, words: str) -> None:
    assert _measured(LoadedRow(name, None, 220.0, 4e3, value, 0.01 * value, {})) == words
