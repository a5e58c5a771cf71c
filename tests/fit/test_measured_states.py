"""States of a laboratory's table, the share of each in a fit, and which would add most."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.targets import with_measured
from tyrecal.simulate.evaluate.failure import DeckRefused
from tyrecal.simulate.modes.label import Label
from tyrecal.simulate.modes.loaded import Member
from tyrecal.studies.fit.calibrate import check
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.states import _best_measured, next_states
from tyrecal.studies.fit.targets import Target, ValueTarget, read_targets, target_labels
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.tyre.state import AS_THE_CASE, TyreState
from tyrecal.tyre.values import with_values

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

LINES = """label,frequency_Hz,sigma_Hz,area [cm2],pressure_kPa,load_N,rim
"[2,0]",79.5,0.4,,240,,
"[2,0]",71.5,0.4,,160.2,,fixed
"[2,1]",60.5,0.4,,160,,free
"[0,0] lateral",45.5,0.4,,240.3,,free
"[2,1]",66.5,0.4,,240,4000,
"""


def test_a_laboratorys_table_becomes_targets_in_their_states(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text(
        LINES.replace("area [cm2],", "member,")
        .replace("240,4000,", "240,4000,")
        .replace("66.5,0.4,,", "66.5,0.4,symmetric,")
    )
    case, notes = with_measured(CASE, path)
    assert not notes
    modes = [
        (t.c, t.m, t.pressure_kPa, t.rim, t.load_N, t.symmetry) for t in case.case.targets.modes
    ]
    assert modes == [
        (2, 0, None, None, None, None),
        (2, 0, 160.2, None, None, None),
        (2, 1, 160.2, "free", None, None),  # pressures that differ by little are one
        (0, 0, None, "free", None, None),
        (2, 1, None, None, 4000.0, "symmetric"),
    ]
    assert target_labels(case) == [Label(2, 0), Label(2, 1), Label(0, 0, "axial")]
    assert next(iter(read_targets(case))).state == AS_THE_CASE
    (road,) = Problem(case, TyreInStates()).road  # type: ignore[arg-type]
    assert road.state == TyreState(None, 4000.0) and str(road.member) == "[2,1] symmetric"
    at_160 = replace(with_values(CASE, {"pressure_kPa": 160.0}), overrides={"pressure_kPa": 160.0})
    case, (note,) = with_measured(at_160, path)
    assert {t.pressure_kPa for t in case.case.targets.modes} == {None} and note.startswith(
        "3 values"
    )


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('"[3,0]",90,0.4,240,0,springs', "line 2: the rim has no springs in this case: give a"),
        ('"[3,0]",90,0.4,2000,0,fixed', "line 2: pressure_kPa must be less than 2000"),
    ],
)
def test_a_state_that_the_case_cannot_compute_is_refused(
    tmp_path: Path, line: str, words: str
) -> None:
    path = tmp_path / "m.csv"
    path.write_text(
        "label,frequency_Hz,sigma_Hz,pressure_kPa,load_N,rim\n"
        + line
        + "\n"
        + '"[2,0]",79,0.4,240,0,\n'
    )
    with pytest.raises(InputError, match=words.replace("(", r"\(")):
        with_measured(CASE, path)


def test_a_solver_without_a_moving_rim_refuses_before_it_starts() -> None:
    tyre = TyreInStates()
    tyre.solver.capabilities = set()
    with pytest.raises(DeckRefused, match="a rim that moves"):
        check(Problem(case_with(measured()), tyre))  # type: ignore[arg-type]
    assert tyre.calls == 0


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
