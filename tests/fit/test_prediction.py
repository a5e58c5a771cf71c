"""Standard errors of frequencies that were not measured: by draws, and over a sweep of a fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from tyrecal.files import json_text
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.fit.prediction import prediction_variance, read_responses
from tyrecal.studies.pressure import PressureFindings
from tyrecal.studies.pressure_result import PressureRow, PressureSweep, run
from tyrecal.studies.result import ModeEntry
from tyrecal.tyre.case import start_values
from tyrecal.tyre.case.schema import Uncertainty

from ..calibrated import calibrate
from ..chance import Chance
from .test_total_error import ANGLE, coarse


@pytest.mark.numbers
def test_the_variance_is_that_of_fits_to_drawn_tyres(chance: Chance) -> None:
    """A linear model of three variables, fitted by scatter alone to 8 values, off in 3 others.

    False failures: 3e-7.
    """
    random, draws = chance.random, 5000
    n, m, v, k = 8, 3, 3, 2
    J, other = random.normal(size=(n, v)), random.normal(size=(m, v))
    G = 0.01 * random.normal(size=(n + m, k))
    scatter = 0.003 * random.uniform(0.5, 2, n)
    root = 0.004 * random.normal(size=(n + m, n + m)) / np.sqrt(n + m)
    W = np.diag(scatter**-2)
    R = np.linalg.solve(J.T @ W @ J, J.T @ W)
    variance = prediction_variance(other, R, scatter, root @ root.T + G @ G.T)
    off = random.normal(size=(draws, n + m)) @ root.T + random.normal(size=(draws, k)) @ G.T
    measured = off[:, :n] + scatter * random.normal(size=(draws, n))  # of a tyre with x = 0
    errors = measured @ R.T @ other.T - off[:, n:]
    for own, spread in zip(errors.T, np.sqrt(variance), strict=True):
        chance.distributed(own, norm(scale=spread).cdf)


@pytest.mark.slow
def test_a_sweep_of_a_fitted_design_has_intervals(tmp_path: Path) -> None:
    """The fit to a tyre with another belt angle is off at another pressure as the standard error by
    the angle has it, which is what it adds to that by the mesh; the initial design has none."""
    case = coarse("exact", {"angle": Uncertainty(sets=[ANGLE], absolute=1.0)})
    start, kPa = start_values(case), 1.4 * case.case.pressure_kPa
    evaluator = Evaluator(TyreDesign(case))
    layers = dict(case.case.rebar_layers)
    layers["belt_1"] = layers["belt_1"].model_copy(
        update={"angle_deg": layers["belt_1"].angle_deg + 1.0}
    )
    turned = replace(case, case=case.case.model_copy(update={"rebar_layers": layers}))
    there = Evaluator(TyreDesign(turned))
    pressures = [case.case.pressure_kPa, kPa]
    own = run(turned, there, {"initial": start}, pressures).rows
    hertz = [{mode.label: mode.frequency_Hz for mode in row.modes} for row in own]
    modes = []
    for t in case.case.targets.modes:
        f = next(f for x, f in hertz[0].items() if (x.c, x.m, x.kind) == (t.c, t.m, t.kind))
        modes.append(t.model_copy(update={"frequency_Hz": f, "sigma_Hz": 1e-5 * f}))
    targets = case.case.targets.model_copy(update={"modes": modes})
    measured = replace(case, case=case.case.model_copy(update={"targets": targets}))
    fit = calibrate(measured, evaluator.of(TyreDesign(measured)), "gauss-newton").found
    (tmp_path / "fit.json").write_text(json_text(fit.content() | {"chi2_per_dof": None}))
    known = read_responses(tmp_path)
    assert len(known.responses) == len(modes)
    fitted = {name: each.value for name, each in fit.variables.items()}
    designs = {"initial": start, "fitted": fitted}
    sure = {"angle": Uncertainty(sets=[ANGLE], absolute=1e-6)}
    by_mesh = replace(measured, case=measured.case.model_copy(update={"uncertainties": sure}))
    errors = []
    for each in (measured, by_mesh):
        swept = run(each, evaluator, designs, [kPa], fit=known)
        initial, predicted = (row.modes for row in swept.rows)
        assert all(mode.standard_error_Hz is None for mode in initial)
        errors.append(np.array([mode.standard_error_Hz or np.nan for mode in predicted]))
    off = np.array([mode.frequency_Hz - hertz[1][mode.label] for mode in predicted])
    assert max(abs(off)) > 0.1
    by_angle = np.sqrt(errors[0] ** 2 - errors[1] ** 2)
    np.testing.assert_allclose(by_angle, abs(off), atol=0.01, rtol=0.1)
    assert "standard_error_Hz" in swept.csv()


def test_a_table_shows_the_half_width_of_the_interval() -> None:
    mode = ModeEntry(c=2, m=0, kind=None, frequency_Hz=79.5, standard_error_Hz=1.0)
    rows = [PressureRow(design="fitted", pressure_kPa=p, modes=[mode]) for p in (200, 250)]
    curve = {"c": 2, "m": 0, "kind": None, "rise_Hz": 0.0, "rise_percent": 0.0, "curvature": ""}
    ends = PressureFindings(design="fitted", from_kPa=200, to_kPa=250, modes=[curve], words=[])
    (table,) = PressureSweep(rows=rows, findings=[ends]).tables()
    assert list(table.rows[0][2:4]) == ["79.50 ± 1.6", "79.50 ± 1.6"]
    assert "90 % interval of the tyre's own frequency" in table.caption
