"""A tyre with frequencies in closed form, to test the optimiser, and the paper's case;
and residuals that are linear in a box, where every step of a search is known by hand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from tyrecal.simulate.deck.decks import steps
from tyrecal.simulate.evaluate.evaluator import Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.results import Evaluation, HarmonicShape, RawMode
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.fit.problem import Point
from tyrecal.studies.fit.targets import Target, read_targets
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.load import load_case

from ..chance import generator
from ..conftest import CASES

Array = np.ndarray


WIDTH = np.linspace(-0.08, 0.08, 9)


POINTS = np.stack([np.full(9, 0.39), WIDTH], 1)


LABELS = [
    Label(0, 0, "axial"),
    Label(0, 0, "torsional"),
    Label(1, 1),
    Label(1, 0),
    Label(2, 1),
    Label(2, 0),
    Label(3, 0),
    Label(3, 1),
    Label(4, 0),
]


def shape(label: Label) -> HarmonicShape:
    """The belt moving as the label says."""
    u = np.zeros((9, 3), complex)
    if label.kind == "axial" or label.m == 1:
        u[:, 2] = 1.0
    elif label.kind == "torsional":
        u[:, 1] = 1.0
    else:
        u[:, 0], u[:, 1] = 1.0, 1j / label.c
    return HarmonicShape(label.c, np.arange(9), POINTS, u)


class FakeEvaluator:
    """Frequencies f_i = base_i exp(sum_j power_ij ln(x_j / start_j)), with exact slopes.

    fails: designs for which the solver gives up.
    """

    solver_name, folder, solver, scheduler = "fake", None, None, ""
    design = SimpleNamespace(steps=partial(steps, load_case(CASES / "p235_75r17.yaml")))

    def __init__(
        self,
        base: Mapping[Label, float],
        powers: Mapping[str, np.ndarray],
        start: Mapping[str, float],
        fails: Callable[[Mapping[str, float]], bool] = lambda values: False,
        has_gradients: bool = True,
    ):
        self.base, self.powers, self.start = base, powers, start
        self.fails, self.has_gradients = fails, has_gradients
        self.round: Callable[[np.ndarray], np.ndarray] = lambda f: f  # to a solver's digits
        self.calls, self.jobs = 0, []  # questions; at a time, call by call

    @property
    def difference_step(self) -> float | None:
        return None if self.has_gradients else getattr(self.solver, "difference_step", 1e-4)

    def answer_all(
        self, questions: Iterable[Question], jobs: int = 1
    ) -> Iterator[Evaluation | EvaluationFailed | DeckRefused]:
        self.jobs.append(jobs)
        for question in questions:
            try:
                yield self.evaluate(question)
            except (EvaluationFailed, DeckRefused) as failure:
                yield failure

    def evaluate(self, question: Question) -> Evaluation:
        self.calls += 1
        values = question.values
        if self.fails(values):
            raise EvaluationFailed("no_equilibrium", "inflation stopped at 12 of 240 kPa")
        f = np.array([self.base[label] for label in LABELS])
        for name, power in self.powers.items():
            f = f * (values[name] / self.start[name]) ** power
        f = self.round(f)
        modes = tuple(
            RawMode(float(x), shape(label), 2 if label.c else 1)
            for x, label in zip(f, LABELS, strict=True)
        )
        assert self.has_gradients or not question.gradients
        gradients = {n: f * self.powers[n] / values[n] for n in question.gradients}
        return Evaluation(240.0, 12.8, modes, gradients)


CASE = load_case(CASES / "p235_75r17.yaml")


START = start_values(CASE)


START_X = np.log(list(START.values()))


TARGETS = {t.label: t.frequency_Hz for t in read_targets(CASE)}


POWERS = {
    "A_belt": np.array([-0.05, -0.05, -0.05, -0.05, -0.03, -0.05, -0.045, -0.03, -0.04]),
    "A_carcass": np.array([0.03, 0.01, 0.03, 0.04, 0.02, 0.03, 0.02, 0.01, 0.005]),
    "C10": np.array([0.04, 0.19, 0.07, 0.1, 0.11, 0.08, 0.08, 0.11, 0.08]),
}


TRUTH = {"A_belt": 4e-7, "A_carcass": 1.5e-7, "C10": 4.5e5}


def evaluator(truth: dict[str, float] = TRUTH, powers=POWERS, **options) -> FakeEvaluator:
    """A fake tyre that meets the targets exactly at ``truth``."""
    base = {
        label: TARGETS[label]
        * float(np.prod([(START[n] / truth[n]) ** p[i] for n, p in powers.items()]))
        for i, label in enumerate(LABELS)
    }
    return FakeEvaluator(base, powers, START, **options)


def with_targets(**changes: list) -> LoadedCase:
    """The case with a field of its targets replaced, target by target."""
    modes = [
        t.model_copy(update={name: values[i] for name, values in changes.items()})
        for i, t in enumerate(CASE.case.targets.modes)
    ]
    targets = CASE.case.targets.model_copy(update={"modes": modes})
    return replace(CASE, case=CASE.case.model_copy(update={"targets": targets}))


def point(x: Any, r: Any, J: Any, modes: dict | None = None) -> Point:
    x, r, J = (np.array(each, float) for each in (x, r, J))
    return Point({}, x, r, J, modes or {}, 1.0, 1.0, np.empty(0))


class Linear:
    """Residuals J x - y within a box; ``wall``: x that have no solution."""

    targets: tuple[Target, ...] = ()
    in_sigmas = False

    def __init__(self, J: Array, y: Array, box: float = 10.0):
        self.J, self.y = J, y
        self.asked: list[Array] = []
        self.lower, self.upper = np.full(J.shape[1], -box), np.full(J.shape[1], box)
        self.wall = lambda x: False
        self.added = lambda x: 0.0  # to the residuals, and to no slope

    def evaluate(self, x: Array) -> Point:
        self.asked.append(x)
        assert (x >= self.lower).all() and (x <= self.upper).all()
        if self.wall(x):
            raise EvaluationFailed("no_equilibrium", "beyond the wall")
        return point(x, self.J @ x - self.y + self.added(x), self.J)


def linear(key: object = 0, box: float = 10.0, rows: int = 7, columns: int = 3) -> Any:
    random = generator("linear", key)
    J = random.normal(size=(rows, columns))
    return Linear(J, J @ random.normal(size=columns) + 0.3 * random.normal(size=rows), box)
