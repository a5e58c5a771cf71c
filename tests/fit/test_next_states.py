"""Contribution of each state to a fit, and the states that would add most if they were measured
next."""

from __future__ import annotations

from math import sqrt
from types import SimpleNamespace

import numpy as np
import pytest

from tyrecal.simulate.modes.label import Label
from tyrecal.simulate.modes.loaded import Member
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.states import _best_measured, next_states
from tyrecal.studies.fit.targets import Target, ValueTarget
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.tyre.state import AS_THE_CASE, TyreState

from .tyre_in_states import (
    CASE,
    SIGMA,
    STATES,
    TRUTH,
    TyreInStates,
    case_with,
    fitted,
    measured,
    point_of,
)


@pytest.mark.numbers
def test_each_state_adds_what_a_fit_without_it_lacks() -> None:
    """Standard errors without a state are those of the targets that are left, at the same design;
    those of k repeats of one state are sqrt(k) smaller."""
    problem, point = point_of(case_with(measured(noise=1.0)), TRUTH)
    known = uncertainty(problem, point)
    fit = fitted(case_with(measured(noise=1.0)))
    for state, entry in zip(STATES, fit.result["states"], strict=True):
        rest = [s for s in STATES if s != state]
        fewer, there = point_of(case_with(measured(rest)), dict(fit.fitted.values))
        expected = uncertainty(fewer, there).standard_errors
        assert list(entry["standard_errors_without"].values()) == pytest.approx(expected, rel=1e-9)
    assert all(e and e > 0 for e in known.standard_errors)
    alone = uncertainty(*point_of(case_with(measured([AS_THE_CASE])), TRUTH)).standard_errors
    repeated = measured([AS_THE_CASE], sigma=SIGMA / sqrt(6))
    again = uncertainty(*point_of(case_with(repeated), TRUTH)).standard_errors
    assert np.array(again) * sqrt(6) == pytest.approx(np.array(alone), rel=1e-9)
    for place, entry in enumerate(fit.result["states"]):
        own = fit.result["modes"][9 * place : 9 * place + 9]
        off = [(m["fitted_Hz"] - m["target_Hz"]) / m["sigma_Hz"] for m in own]
        assert entry["rms_sigmas"] == pytest.approx(np.sqrt(np.mean(np.square(off))), rel=1e-9)


@pytest.mark.numbers
def test_the_next_state_is_the_one_whose_fit_would_be_best() -> None:
    """The stated standard errors are those of a fit that has the state; the most informative is
    first."""
    have = STATES[:2]
    fit = fitted(case_with(measured(have)))
    proposals = fit.found.next_states
    states = {(each.pressure_kPa, each.rim) for each in proposals}
    assert states == {(p, rim) for p in (190.0, 300.0) for rim in ("fixed", "free")}
    assert [each.ratio for each in proposals] == sorted(each.ratio for each in proposals)  # type: ignore[type-var]
    x = dict(fit.fitted.values)
    before = list(uncertainty(*point_of(case_with(measured(have)), x)).standard_errors)
    for each in proposals:
        more = measured([*have, TyreState(each.pressure_kPa, 0.0, each.rim)])  # type: ignore[arg-type]
        like = {(t.c, t.m, t.kind): t.sigma_Hz / t.frequency_Hz for t in more[:9]}  # type: ignore[operator]
        scaled = [
            t.model_copy(update={"sigma_Hz": like[t.c, t.m, t.kind] * t.frequency_Hz})
            for t in more[18:]
        ]
        after = uncertainty(*point_of(case_with([*more[:18], *scaled]), x)).standard_errors
        assert list(each.standard_errors_with.values()) == pytest.approx(after, rel=1e-3)
        ratio = np.exp(np.mean(np.log(np.array(after) / before)))
        assert each.ratio == pytest.approx(ratio, rel=1e-3) and ratio < 1


def test_modes_under_a_load_are_like_those_of_a_next_state() -> None:
    """Loaded modes count once each if no unloaded state was measured; the unloaded state is then
    proposed."""
    at_load = TyreState(None, 4000.0)
    targets = [
        ValueTarget("frequency_Hz", 80.0, 0.4, state=at_load, member=Member(Label(2, 0), side))
        for side in ("symmetric", "antisymmetric")
    ]
    area = ValueTarget("contact_area_m2", 0.02, 1e-4, state=at_load)
    free = TyreState(None, 0.0, "free")
    hung = Target(Label(3, 0), 100.0, state=free)
    sigma = np.array([0.4, 0.6, 1e-4, 0.5])
    some = lambda *rows: SimpleNamespace(measured=list(rows))
    known = lambda *which: SimpleNamespace(sigma=sigma[list(which)])
    ((mode, relative),) = _best_measured(some(*targets, area), known(0, 1, 2))  # type: ignore[arg-type]
    assert (mode.label, mode.multiplicity, relative) == (Label(2, 0), 2, 0.4 / 80.0)
    ((mode, relative),) = _best_measured(some(*targets, hung), known(0, 1, 3))  # type: ignore[arg-type]
    assert (mode, relative) == (hung, 0.005)
    assert _best_measured(some(area), known(2)) == []  # type: ignore[arg-type]


def test_no_state_is_proposed_that_cannot_be_computed() -> None:
    tyre = TyreInStates()
    tyre.solver.capabilities = set()
    problem = Problem(case_with(measured([TyreState(160.0), AS_THE_CASE])), tyre)  # type: ignore[arg-type]
    point = problem.evaluate(problem.start())
    proposals = next_states(problem, point, uncertainty(problem, point))
    states = [each.state.with_defaults(CASE) for each in proposals]
    assert {(s.pressure_kPa, s.rim) for s in states} == {(130.0, "fixed"), (300.0, "fixed")}
    tyre.has_gradients = False
    bare = Problem(problem.case, tyre)  # type: ignore[arg-type]
    assert next_states(bare, point, uncertainty(problem, point)) == []
