"""The 205/60R15: fitted to published rigid-belt modes, it has the published load-deflection."""

from __future__ import annotations

import csv
from dataclasses import replace

import pytest

from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.fit.calibrate import Fit
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case

from ..calibrated import calibrate
from ..conftest import CASES

SET_B = {"axial": 41.47, "torsional": 67.73, "[1,1]": 53.46, "[1,0]": 76.63}  # Hz, other tyre
DEFLECTION_3_KN = 15.47e-3  # m, of set A


@pytest.fixture(scope="module")
def case() -> LoadedCase:
    case = load_case(CASES / "205_60r15.yaml")
    mesh = case.case.mesh.model_copy(update={"level": "coarse"})
    return replace(case, case=case.case.model_copy(update={"mesh": mesh}))


@pytest.fixture(scope="module")
def fitted(case: LoadedCase) -> Fit:
    return calibrate(
        case, Evaluator(TyreDesign(case)), fixed={"A_belt": case.case.variables["A_belt"].start}
    )


def test_the_case_has_the_targets_of_its_table(case: LoadedCase) -> None:
    readings = read_measurements(CASES / "205_60r15_mf_swift.csv")
    table = {(r.label.c, r.label.m, r.label.kind): (r.value, r.sigma) for r in readings if r.label}
    targets = case.case.targets.modes
    assert table == {(t.c, t.m, t.kind): (t.frequency_Hz, t.sigma_Hz) for t in targets}
    assert all(r.pressure_kPa == case.case.pressure_kPa for r in readings if r.label)


def test_the_stiffnesses_are_those_of_the_published_deflections() -> None:
    deflections_mm = [5.33, 10.48, 15.47, 20.31, 25.02, 29.59]  # at 1 to 6 kN
    with (CASES / "205_60r15_mf_swift.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if "stiffness" in row["quantity"]]
    for row in rows:
        kN = round(float(row["load_N"]) / 1000)
        rise = (deflections_mm[kN] - deflections_mm[kN - 2]) * 1e-3
        assert float(row["value"]) == pytest.approx(2000 / rise, rel=1e-3)


def test_the_fit_meets_what_was_measured_well(fitted: Fit) -> None:
    assert fitted.result["converged"] and fitted.result["objective_Hz"] < 1
    modes = {m["kind"] or f"[{m['c']},{m['m']}]": m for m in fitted.result["modes"]}
    for name in ("axial", "[1,1]", "[1,0]"):
        assert abs(modes[name]["deviation_percent"]) < 0.5
    torsional = modes["torsional"]
    assert torsional["target_Hz"] < torsional["fitted_Hz"] < SET_B["torsional"]
    assert fitted.result["mass_kg"] == pytest.approx(9.3, rel=0.06)  # bead wires are left out


def test_four_modes_do_not_determine_the_belt(case: LoadedCase) -> None:
    result = calibrate(case, Evaluator(TyreDesign(case))).result
    assert result["variables"]["A_belt"]["standard_error"] > result["variables"]["A_belt"]["value"]
    assert result["correlations"]["A_belt"]["C10"] > 0.98
    assert result["singular_values"][-1] < 1 < result["singular_values"][-2]


@pytest.mark.slow
def test_the_deflection_is_predicted(case: LoadedCase, fitted: Fit) -> None:
    pressed = Evaluator(TyreDesign(case)).press(fitted.fitted.values, [3000.0])
    (footprint,) = pressed.footprints
    assert footprint.deflection_m == pytest.approx(DEFLECTION_3_KN, rel=0.08)
