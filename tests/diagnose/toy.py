"""A tyre in closed form: smooth random answers of x and effects, to test the statistics alone."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.polynomial import Polynomial

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.expansion import Expansion, expand
from tyrecal.studies.inference.inverse_problem import Assumed, InverseProblem, Toggle, places
from tyrecal.studies.inference.model import Answer, EffectRange, Query
from tyrecal.studies.inference.observations import Observable, Observations

Array = np.ndarray
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
HERTZ = [31.7, 35.0, 37.8, 58.5, 66.1, 79.5, 97.6, 102.7, 115.9]


class Toy:
    """eta = ln f0 + J d + bend (d . d) + e g + curve (e g)^2 + e B d, rows (label, pressure).

    Effects "e0", "e1", ...: range 0..1, each shifts modes by up to ``size``; "twin" copies e0.
    """

    variables = ("A", "B", "C")
    sloped: Collection[str] = ()
    sloped_at_0: Collection[str] = ()
    material_laws = 0.0

    def __init__(
        self,
        effects: int = 6,
        pressures: Sequence[float] = (160.0, 240.0, 320.0),
        size: float = 0.02,
        seed: int = 0,
        twin: bool = False,
        bend: float = 0.02,
    ):
        random = np.random.default_rng(seed)
        self.rows = [(label, float(p)) for p in pressures for label in LABELS]
        n = len(self.rows)
        self.start, self.spread = np.zeros(3), np.full(3, 1.0)
        self.sources = ("density", "gauge")
        by_mode = lambda scale: np.concatenate(
            [
                m + random.normal(0, scale / 5, len(LABELS))
                for m in [random.normal(0, scale, len(LABELS))]
                for _ in pressures
            ]
        )
        self.base = np.log(np.tile(HERTZ, len(pressures))) + 0.4 * np.log(
            np.repeat(pressures, len(LABELS)) / 240.0
        )
        self.J = np.stack([by_mode(0.3) for _ in range(3)], 1)
        self.bend = bend * np.stack([by_mode(1.0)], 1)[:, 0]
        self.g = {f"e{i}": by_mode(size) for i in range(effects)}
        if twin:
            self.g["twin"] = 0.98 * self.g["e0"]
        self.tilt = {id: 0.1 * random.normal(0, size, (n, 3)) for id in self.g}
        self.constants = np.stack([by_mode(0.003), by_mode(0.003)], 1)
        self.ranges = {id: EffectRange(0.0, 1.0) for id in self.g}
        self.splits = {id: np.zeros(n) for id in self.g}
        self.asked = 0

    @property
    def designs(self) -> Toy:
        """Itself: it has its coordinates' values and units."""
        return self

    def values(self, x: Array) -> dict[str, float]:
        """The variables, of a logarithmic scale about 2."""
        return {name: 2.0 * float(np.exp(xi)) for name, xi in zip(self.variables, x, strict=True)}

    def unit(self, variable: str) -> str:
        return "Pa"

    def answers(self, points: Sequence[Query]) -> list[Answer | Exception]:
        self.asked += len(points)
        return [self._answer(point) for point in points]

    def _answer(self, point: Query) -> Answer:
        x = point.x
        eta = self.base + self.J @ x + self.bend * (x @ x)
        J = self.J + 2 * self.bend[:, None] * x
        split = np.zeros(len(eta))
        for id, e in point.effects.items():
            eta = eta + e * self.g[id] + e * self.tilt[id] @ x
            J = J + e * self.tilt[id]
            split = split + e * self.splits[id]
        return Answer(eta, J, split, self.constants if point.constants else None)


class Sloped(Toy):
    """eta + 2e-4 e^power, with slopes by the effect, or the one where it is 0."""

    def __init__(self, power: int, at_0: bool = False, span: EffectRange | None = None):
        super().__init__(effects=1, size=0.0, pressures=(240.0,))
        self.curve, self.at_0 = 2e-4 * Polynomial([0.0] * power + [1.0]), at_0
        self.ranges = {"e0": span or EffectRange(0.0, 1.0)}
        self.sloped, self.sloped_at_0 = ((), ("e0",)) if at_0 else (("e0",), ())
        self.points: list[Query] = []

    def answers(self, points: Sequence[Query]) -> list[Answer | Exception]:
        self.points += points
        return super().answers(points)

    def _answer(self, point: Query) -> Answer:
        answer, e = super()._answer(point), point.effects.get("e0", 0.0)
        assert not point.slopes or (e == 0) == self.at_0
        slope = np.full(len(answer.eta), self.curve.deriv()(e))
        slope[-1] = np.nan  # the last row has none
        eta = answer.eta + self.curve(e)
        return replace(answer, eta=eta, slopes=dict.fromkeys(point.slopes, slope))


def flat(**keys: object) -> Toy:
    """A toy that is linear in x and e together."""
    toy = Toy(bend=0.0, **keys)  # type: ignore[arg-type]
    for id in toy.tilt:
        toy.tilt[id] = 0 * toy.tilt[id]
    return toy


def problem(
    toy: Toy,
    y: Array | None = None,
    noise: float = 0.002,
    assumed: Assumed = Assumed(form=0.001, response_error=0.0),  # noqa: B008
    x0: Array | None = None,
    changes: tuple[Toggle, ...] = (),
) -> InverseProblem:
    """The toy beside data y, by default its own without scatter; one run more for each change."""
    expansion: Expansion = expand(toy, np.zeros(3) if x0 is None else x0)
    rows = tuple(
        Observable("frequency_Hz", label, p, run)
        for run in range(1 + len(changes))
        for label, p in toy.rows
    )
    n = len(rows)
    y = np.tile(toy.base, 1 + len(changes)) if y is None else y
    none = np.full(n, np.nan)
    observations = Observations(rows, y, np.full(n, noise), 0.0, none, none)
    return InverseProblem(
        observations,
        expansion,
        toy.ranges,
        places(observations, toy.rows),
        toy.start,
        toy.spread,
        changes,
        assumed,
    )


def drawn(
    toy: Toy,
    base: InverseProblem,
    random: np.random.Generator,
    effects: dict[str, float],
    spread: float,
) -> Array:
    """Data (n,) with effects, design variables drawn by ``spread``, and everything off by Sigma."""
    x = random.normal(0, spread, 3)
    (answer,) = toy.answers([Query(x, effects)])
    assert isinstance(answer, Answer)
    # by Cholesky's factor: an SVD's vectors, the default, depend on the BLAS kernel
    return random.multivariate_normal(answer.eta[base.places], base.sigma, method="cholesky")
