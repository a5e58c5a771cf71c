"""Constants as a diagnosis reports them are those of `sensitivities`, with all of them free."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tyrecal.studies.diagnose.constants_posterior import constants_posterior
from tyrecal.studies.diagnose.diagnosis import diagnose
from tyrecal.studies.inference.inverse_problem import Assumed
from tyrecal.studies.sensitivities.selection import likeliest_shifts

from ..chance import generator
from .toy import flat, problem


@pytest.mark.parametrize("spread", [1.0, 0.02])
def test_constants_are_their_mean_over_all_tyres_that_fit(spread: float) -> None:
    """Also where the variables are known before, so that they do not absorb all that they could:
    the closed form, by the covariance of deviations at the variables' prior."""
    toy: Any = flat(effects=0, pressures=(160.0, 240.0))
    toy.spread = np.full(3, spread)
    toy.constants *= 3
    base = problem(toy, assumed=Assumed(form=0.001))
    off = toy.constants @ [2.0, -1.5] + toy.J @ np.full(3, 0.5 * spread)
    y = toy.base + off + 0.002 * generator("constants").normal(size=len(toy.base))
    data = base.measured(y).observations
    diagnosis = diagnose(toy, toy.rows, data, assumed=Assumed(form=0.001), ranked=False)
    reported = {each.name: each.shift_in_sd for each in constants_posterior(diagnosis)}
    J = toy.J * toy.spread
    known = base.covariance(data, np.zeros((len(y), 0))) + J @ J.T
    shifts = likeliest_shifts(y - toy.base, known, toy.constants)
    assert list(reported) == sorted(reported, key=lambda name: -abs(reported[name]))
    assert reported == pytest.approx(dict(zip(toy.sources, shifts, strict=True)), abs=1e-3)
