"""A tyre in closed form in several states, what is measured of it, and fits of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Question
from tyrecal.simulate.evaluate.failure import DeckRefused
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.studies.fit.calibrate import Fit
from tyrecal.studies.fit.problem import Point, Problem
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.case.schema import TargetMass, TargetMode, Targets
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import TyreState

from ..chance import generator
from ..conftest import CASES
from ..solved import calibrate
from .fake import LABELS, FakeEvaluator

CASE = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
START = start_values(CASE)
TRUTH = {"A_belt": 2.6e-7, "A_carcass": 2.5e-7, "C10": 7e5}
STATES = [TyreState(p, 0.0, rim) for p in (None, 160.0, 320.0) for rim in (None, "free")]
SIGMA = 0.2


class TyreInStates(FakeEvaluator):
    """The closed form of `fake`, in pressures and on rims: f grows with p^0.4 and less with C10 at
    more pressure; a free rim lifts the modes of c <= 1. ``asked``: (pressure, free) of each
    question, batch by batch."""

    def __init__(self) -> None:
        base = {label: 30.0 + 9.0 * i for i, label in enumerate(LABELS)}
        turns = 1.0 + np.arange(len(LABELS))
        powers = {n: 0.2 + 0.1 * np.sin(turns * (2 + k)) for k, n in enumerate(START)}
        super().__init__(base, powers, START)
        self.design, self.counts = TyreDesign(CASE), None
        self.solver: Any = type(
            "Fake", (), {"capabilities": {"spindle"}, "name": "fake", "version": "1"}
        )
        self.asked: list[list[tuple[float, bool]]] = []

    def answer_all(self, questions: Any, jobs: int = 1) -> Iterator[Any]:
        plain = [Question(q.values, q.gradients) for q in questions]
        state = lambda v: (v.get("pressure_kPa", 240.0), bool(v.get("rim.free", False)))
        self.asked.append([state(q.values) for q in plain])
        return super().answer_all(plain, jobs)

    def evaluate(self, question: Question) -> Evaluation:
        values = dict(question.values)
        ratio, free = values.get("pressure_kPa", 240.0) / 240.0, values.get("rim.free", False)
        alone = super().evaluate(Question(values))
        softer = (values["C10"] / START["C10"]) ** (-0.1 * np.log(ratio))
        lift = np.array([1.3 if free and label.c < 2 else 1.0 for label in LABELS])
        factor = ratio**0.4 * softer * lift
        f = factor * [mode.frequency_Hz for mode in alone.modes]
        modes = tuple(
            replace(m, frequency_Hz=float(x)) for m, x in zip(alone.modes, f, strict=True)
        )
        steep = {n: p - 0.1 * np.log(ratio) * (n == "C10") for n, p in self.powers.items()}
        gradients = {n: f * steep[n] / values[n] for n in question.gradients}
        mass = {n: 2.0 / START[n] for n in question.gradients}
        heavy = 10.0 + sum(2.0 * values[n] / START[n] for n in START)
        return Evaluation(ratio * 240.0, heavy, modes, gradients, mass_gradients=mass)

    def refuse_lacking(self, design: Any) -> None:
        if "spindle" in design.needs and "spindle" not in self.solver.capabilities:
            raise DeckRefused("cannot express a rim that moves")


def case_with(modes: list[TargetMode], mass: TargetMass | None = None) -> LoadedCase:
    targets = Targets(modes=modes, mass=mass)
    return replace(CASE, case=CASE.case.model_copy(update={"targets": targets}))


def measured(
    states: list[TyreState] = STATES, noise: float = 0.0, seed: int = 0, sigma: float = SIGMA
) -> list[TargetMode]:
    """The frequencies of TRUTH in every state, off by ``noise`` sigmas."""
    tyre, drawn = TyreInStates(), generator("states", seed)
    rows = []
    for state in states:
        at = tyre.evaluate(Question(state.design(CASE, TRUTH)))
        for label, mode in zip(LABELS, at.modes, strict=True):
            rows.append(
                TargetMode(
                    c=label.c,
                    m=label.m,
                    kind=label.kind,  # type: ignore[arg-type]
                    frequency_Hz=mode.frequency_Hz + noise * sigma * drawn.normal(),
                    sigma_Hz=sigma,
                    pressure_kPa=state.pressure_kPa,
                    rim=state.rim,
                )
            )
    return rows


def fitted(case: LoadedCase, tyre: Any = None, **options: Any) -> Fit:
    made: Any = tyre or TyreInStates()
    return calibrate(case, made, **options)


def point_of(case: LoadedCase, x: Mapping[str, float] = START) -> tuple[Problem, Point]:
    problem = Problem(case, TyreInStates())  # type: ignore[arg-type]
    return problem, problem.evaluate(np.log([x[v.name] for v in problem.variables]))
