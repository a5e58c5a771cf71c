"""Plans of runs on the road and of differences: numbers by hand, and their words."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies import run_plan
from tyrecal.studies.fit.study import FitStudy
from tyrecal.studies.run_plan import (
    FIRST_LOAD_S,
    FURTHER_DESIGN_S,
    PlannedState,
    RunPlan,
    plan_runs,
    runs_in_words,
)
from tyrecal.tyre.load import load_case

from ..cli.test_cli import CASE, run

PLAN = RunPlan(nodes=1000, places_round=17, designs=2, states=(PlannedState(8),))


def test_its_numbers_by_hand() -> None:
    """3000 displacements in the section, 51000 round half the tyre; 2 designs x (8 + 2) loads."""
    plan = replace(PLAN, states=(PlannedState(8), PlannedState(2)))
    assert (plan.section_unknowns, plan.unknowns, plan.runs) == (3000, 51000, 20)
    one = replace(PLAN, designs=1, states=(PlannedState(1),))
    assert one.seconds == pytest.approx(FIRST_LOAD_S * 51000 * 3000 / 1e9)
    of_six = (1 + 5 * FURTHER_DESIGN_S / FIRST_LOAD_S) * (one.seconds or 0)
    assert replace(one, designs=6).seconds == pytest.approx(of_six)
    assert replace(one, designs=6, at_once=2).seconds == pytest.approx(of_six / 2)
    assert replace(one, at_once=2).memory_bytes == pytest.approx(2 * (one.memory_bytes or 0))
    halved = replace(one, nodes=500)
    assert (halved.seconds or 0) == pytest.approx((one.seconds or 0) / 4)


def test_more_that_is_wanted_takes_longer() -> None:
    first, *more = (
        replace(PLAN, states=(state,)).seconds or 0.0
        for state in (
            PlannedState(1),
            PlannedState(2),
            PlannedState(1, modes=True),
            PlannedState(1, sensitivities=3),
            PlannedState(1, neighbours=3),
        )
    )
    assert min(more) > first
    assert replace(PLAN, states=(PlannedState(1, neighbours=3),)).runs == 8


def test_no_more_run_side_by_side_than_the_memory_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory of 2.5 times the need of one design holds two; in less than one's need, one is
    tried."""
    case = load_case(CASE)
    evaluator = Evaluator(TyreDesign(case))
    states = [PlannedState(1), PlannedState(1)]
    one = plan_runs(case, evaluator, states, designs=3).memory_bytes or 0.0
    for available, at_once in ((2.5 * one, 2), (0.5 * one, 1), (None, 6)):
        monkeypatch.setattr(run_plan, "available_memory_bytes", lambda a=available: a)
        assert plan_runs(case, evaluator, states, 3, at_once=8).at_once == at_once


def test_a_fit_of_fewer_variables_takes_less_time() -> None:
    case = load_case(CASE)
    study = lambda fixed: FitStudy(case, Evaluator(TyreDesign(case)), fixed=fixed)
    plans = [study(fixed).run_plan("slsqp", 1, 1) for fixed in ({}, {"A_belt": 2e-7})]
    assert plans[0].seconds > plans[1].seconds


def test_its_words() -> None:
    assert str(replace(PLAN, designs=1)).startswith(
        "size: 3000 unknowns in the section, 51000 in 3-D (1000 nodes x 17 stations round half the"
        " tyre); 1 design x 1 state x 8 loads: 8 runs; about "
    )
    plan = replace(
        PLAN, states=(PlannedState(1), PlannedState(2)), is_estimate=True, is_timed=False
    )
    assert str(plan).endswith("; about 2 designs x 2 states x 1 or 2 loads: about 6 runs")
    assert plan.content()["seconds"] is None
    unloaded = str(replace(PLAN, states=(PlannedState(),), starts=1))
    assert "3-D" not in unloaded and "2 designs x 1 state + 1 before: 3 runs; about" in unloaded


@pytest.mark.parametrize(
    ("words", "counts"),
    [
        (["footprint", CASE, "--loads-N", "2000,4000"], (1, 1, [2], 2)),
        (["modes", CASE, "--sweep-load", "0,1000,4000"], (1, 1, [2], 2)),
        (["modes", CASE, "--load-N", "4000"], (1, 1, [1], 1)),
        (["fit", CASE], (20, 1, [0], 20)),
    ],
)
def test_a_dry_run_prints_it_and_runs_nothing(
    words: list[str],
    counts: tuple[int, int, list[int], int],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    assert run(*words, "--mesh", "coarse", "--output", str(out), "--dry-run", "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert tuple(printed[key] for key in ("designs", "states", "loads", "runs")) == counts
    assert printed["section_unknowns"] == 699 and printed["unknowns"] == 17 * 699
    assert not out.exists()


def test_a_dry_run_of_a_fit_over_two_pressures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The fit has two stiffnesses at one pressure, a length at another, the mass on no road, and
    seven designs of Gauss-Newton a start."""
    table = tmp_path / "measured.csv"
    table.write_text(
        "load [N],pressure [kPa],vertical stiffness [N/mm],contact length [mm],sigma [%]\n"
        "3000,240,230,,2\n4000,240,235,,2\n4000,200,,170,2\n"
    )
    words = ["fit", CASE, "--measured", str(table), "--mesh", "coarse", "--dry-run"]
    assert run(*words, "--method", "gauss-newton", "--starts", "2") == 0
    printed = capsys.readouterr().out
    assert "about 14 designs x 3 states x 0, 1 or 2 loads: about 56 runs; about" in printed


@dataclass
class Tyre:
    """An evaluator whose run takes 12 s, if it is not recorded."""

    has_gradients: bool = False
    store: object = None
    counts: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(runs=0, clock_s=0.0))
    solver = SimpleNamespace(name="calculix")

    def evaluate(self, question: object) -> None:
        """Run, or recall."""
        if not self.store:
            self.counts.runs, self.counts.clock_s = self.counts.runs + 1, self.counts.clock_s + 12.0


@pytest.mark.parametrize(
    ("tyre", "words"),
    [
        (Tyre(), "300 runs of solver 'calculix', 12 s each: about 30 min with 2 at a time"),
        (Tyre(store="recorded"), "300 runs of solver 'calculix', 12 s each: about 30 min"),
        (Tyre(has_gradients=True), ""),
    ],
)
def test_runs_and_time(tyre: Tyre, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_plan, "monotonic", lambda: tyre.counts.clock_s)
    assert words in runs_in_words(tyre, {}, 300, 2)  # type: ignore[arg-type]
    assert tyre.counts.runs == bool(words)
