"""States as a laboratory's table gives them: values become targets in theirs, or are refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.measured.targets import with_measured
from tyrecal.simulate.evaluate.failure import DeckRefused
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.fit.calibrate import check
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.targets import read_targets, target_labels
from tyrecal.tyre.state import AS_THE_CASE, TyreState
from tyrecal.tyre.values import with_values

from .tyre_in_states import CASE, TyreInStates, case_with, measured

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
