"""The tyre behind the one door as a `Response`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import exp, log, sqrt

import numpy as np

from ..case import LoadedCase, start_values
from ..case.schema import TargetMode, Targets
from ..evaluate.door import Door
from ..evaluate.failure import DeckRefused, EvaluationFailed
from ..fit import problem as fit
from ..modes.mode import Label
from .response import Answer, Point, Span
from .uncertainties import EFFECTS, Source, values_of

Array = np.ndarray
MASS_STEP = 0.02  # of a logarithm: the mass is linear in areas and densities

WORTH_A_POOL = 10  # evaluations, for processes to be started

ModelRow = tuple[Label | None, float]


class TyreModel:
    """ln f of the modes ``rows`` (label, pressure in kPa), and ln mass where the label is None.

    case: its variables are x; found: sources of error; spans: effects that may be asked for;
    jobs: evaluations at a time. Raises DeckRefused where the solver has no exact slopes.
    """

    def __init__(
        self,
        case: LoadedCase,
        door: Door,
        rows: Sequence[ModelRow],
        found: list[Source],
        spans: Mapping[str, Span],
        jobs: int = 1,
    ):
        if not door.has_gradients:
            raise DeckRefused(
                f"solver '{door.solver.name}' gives no exact slopes, which a diagnosis needs:"
                " 'tyrecal solvers' shows which one does (gradients)"
            )
        self.rows, self.found, self.jobs = list(rows), found, jobs
        self.spans: Mapping[str, Span] = spans
        self.pressures = sorted({p for label, p in rows if label}) or [case.case.pressure_kPa]
        labels = sorted({label for label, _ in rows if label}, key=str)
        case = _asked_for(case, labels)
        self.door = door
        door.case = case
        self._fit = fit.Problem(case, door, jobs=jobs)
        self._variables = case.case.variables
        self.variables: Sequence[str] = list(self._variables)
        self.sources: Sequence[str] = [source.name for source in found]
        self.start = np.array([self._scaled(n, v) for n, v in start_values(case).items()])
        wide = [
            log(v.upper / v.lower) if v.scale == "log" else 1.0 for v in self._variables.values()
        ]
        self.spread = np.array(wide) / sqrt(12)  # of a uniform distribution within the bounds
        self._plain = values_of(case, found)
        self._plain.setdefault("pressure_kPa", case.case.pressure_kPa)
        self._slopeless: set[str] = set()
        self._plain_slopes: dict[bytes, Answer | Exception] = {}
        self._mass: tuple[Array, Array, Array] | None = None

    def values(self, x: Array) -> dict[str, float]:
        """Design variables at x, in their own units, bounds not enforced."""
        return {
            name: exp(xi) if v.scale == "log" else v.lower + xi * (v.upper - v.lower)
            for (name, v), xi in zip(self._variables.items(), map(float, x), strict=True)
        }

    def answers(self, points: Sequence[Point]) -> list[Answer | Exception]:
        """Each point at every pressure, ``jobs`` evaluations at a time."""
        results: list[Answer | Exception] = [None] * len(points)  # type: ignore[list-item]
        for constants in (False, True):
            chosen = [i for i, point in enumerate(points) if point.constants == constants]
            if chosen:
                for i, answer in zip(chosen, self._ask([points[i] for i in chosen]), strict=True):
                    results[i] = answer
        for i, point in enumerate(points):
            answer = results[i]
            if point.constants and isinstance(answer, Answer):
                results[i] = self._with_finite(point, answer)
        return results

    def _scaled(self, name: str, value: float) -> float:
        v = self._variables[name]
        return log(value) if v.scale == "log" else (value - v.lower) / (v.upper - v.lower)

    def _ask(self, points: Sequence[Point]) -> list[Answer | Exception]:
        """Points that all want slopes by constants, or none of them."""
        smooth = [p for p in points if not self._slopeless & set(p.effects)]
        try:
            answers = iter(self._evaluated(smooth, self.pressures) if smooth else [])
        except DeckRefused:
            if not self._find_slopeless(smooth):
                raise
            return self._ask(points)
        return [
            self._without_slopes(p) if self._slopeless & set(p.effects) else next(answers)
            for p in points
        ]

    def _find_slopeless(self, points: Sequence[Point]) -> bool:
        """Learn which effects the solver gives no slopes with; whether there are any."""
        before = len(self._slopeless)
        for point in {frozenset(p.effects): p for p in points if p.effects}.values():
            try:
                self._evaluated([point], self.pressures[:1])
            except DeckRefused:
                self._slopeless |= set(point.effects)
        return len(self._slopeless) > before

    def _without_slopes(self, point: Point) -> Answer | Exception:
        """Frequencies with an effect that the solver gives no slopes with: the plain tyre's, at
        the same x, stand for them."""
        key = point.x.tobytes()
        if key not in self._plain_slopes:
            self._plain_slopes = {key: self._evaluated([Point(point.x)], self.pressures)[0]}
        plain = self._plain_slopes[key]
        try:
            (answer,) = self._evaluated([point], self.pressures, exact=False)
        except DeckRefused as refused:
            return refused
        if isinstance(answer, Answer) and isinstance(plain, Answer):
            return replace(answer, jacobian=plain.jacobian)
        return plain if isinstance(answer, Answer) else answer

    def _evaluated(
        self, points: Sequence[Point], pressures: Sequence[float], exact: bool = True
    ) -> list[Answer | Exception]:
        constants = points[0].constants
        paths = list(self._plain) if constants else []
        designs = []
        for point, pressure in product(points, pressures):
            effects = {EFFECTS + id: float(e) for id, e in point.effects.items()}
            known = dict(self._plain) if constants else {}
            designs.append({**self.values(point.x), **known, "pressure_kPa": pressure, **effects})
        found = self._modes(designs, (*self.variables, *paths) if exact else ())
        per = len(pressures)
        if per < len(self.pressures):  # only asked whether there are slopes
            return []
        return [self._answer(p, designs[i * per : (i + 1) * per], found[i * per : (i + 1) * per])
                for i, p in enumerate(points)]  # fmt: skip

    def _modes(
        self, designs: list[dict[str, float]], names: tuple[str, ...] = ()
    ) -> list[fit.Found | EvaluationFailed]:
        self._fit.jobs = self.jobs if len(designs) >= WORTH_A_POOL else 1
        return self._fit.modes(designs, names)

    def _answer(
        self,
        point: Point,
        designs: list[dict[str, float]],
        found: list[fit.Found | EvaluationFailed],
    ) -> Answer | Exception:
        for each in found:
            if isinstance(each, EvaluationFailed):
                return each
        at = dict(zip(self.pressures, zip(designs, found, strict=True), strict=True))
        eta, jacobian = np.zeros(len(self.rows)), np.zeros((len(self.rows), len(self.variables)))
        slopes, split = np.zeros((len(self.rows), len(self.found))), np.zeros(len(self.rows))
        for i, (label, pressure) in enumerate(self.rows):
            if label is None:
                eta[i] = log(found[0][0].mass_kg)  # type: ignore[index]
                jacobian[i], slopes[i] = self._mass_slopes(point.x)
                continue
            design, answer = at[pressure]
            evaluation, modes, _ = answer  # type: ignore[misc]
            f, place = modes[label].frequency_Hz, modes[label].position
            eta[i] = log(f)
            if members := modes[label].raw.members:
                eta[i], split[i] = log(members[0] * members[1]) / 2, log(members[1] / members[0])
            for j, name in enumerate(self.variables if evaluation.gradients else ()):
                jacobian[i, j] = evaluation.gradients[name][place] * self._slope(name, design) / f
            if point.constants:
                for k, source in enumerate(self.found):
                    slopes[i, k] = sum(
                        step * evaluation.gradients[path][place] / f
                        for path, step in source.steps.items()
                        if not path.startswith(EFFECTS)
                    )
        return Answer(eta, jacobian, split, slopes if point.constants else None)

    def _slope(self, name: str, design: Mapping[str, float]) -> float:
        v = self._variables[name]
        return design[name] if v.scale == "log" else v.upper - v.lower

    def _with_finite(self, point: Point, answer: Answer) -> Answer | Exception:
        """Sources that are effects: one step of each, one way."""
        steps = [
            (k, path.removeprefix(EFFECTS), step)
            for k, source in enumerate(self.found)
            for path, step in source.steps.items()
            if path.startswith(EFFECTS)
        ]
        assert answer.constants is not None
        stepped = self.answers([Point(point.x, {id: step}) for _, id, step in steps])
        for (k, _, _), other in zip(steps, stepped, strict=True):
            if isinstance(other, Exception):
                return other
            answer.constants[:, k] += other.eta - answer.eta
        return answer

    def _mass_slopes(self, x: Array) -> tuple[Array, Array]:
        """d ln mass by x (v,) and by the sources of error (k,).

        From neighbours, found once: the mass is m0 + sum of m_j times the value of variable j.
        """
        if self._mass is None:
            own = {**self._plain, **self.values(x), "pressure_kPa": self.pressures[0]}
            designs = [own]
            designs += [{**own, **self.values(x + d)} for d in MASS_STEP * np.eye(len(x))]
            for source in self.found:
                steps = {k: s for k, s in source.steps.items() if not k.startswith(EFFECTS)}
                steps.pop("pressure_kPa", None)
                designs.append({**own, **{k: own[k] + s for k, s in steps.items()}})
            found = self._modes(designs)
            for each in found:
                if isinstance(each, EvaluationFailed):
                    raise each
            mass = np.array([each[0].mass_kg for each in found])  # type: ignore[index]
            count, ratio = len(x), mass[1:] / mass[0]
            rise = self._rise(x, x + MASS_STEP)
            self._mass = x, (ratio[:count] - 1) / rise, np.log(ratio[count:])
        there, shares, sources = self._mass
        rise = self._rise(there, x)
        growth = np.where([v.scale == "log" for v in self._variables.values()], 1 + rise, 1.0)
        return shares * growth / (1 + shares @ rise), sources

    def _rise(self, before: Array, after: Array) -> Array:
        """Relative rise of log variables, rise of x of linear ones."""
        step = after - before
        log_scaled = [v.scale == "log" for v in self._variables.values()]
        return np.where(log_scaled, np.expm1(step), step)


def _asked_for(case: LoadedCase, labels: Sequence[Label]) -> LoadedCase:
    """The case with the measured modes as targets, and enough harmonics for them."""
    modes = [TargetMode(c=x.c, m=x.m, kind=x.kind, frequency_Hz=1.0) for x in labels]  # type: ignore[arg-type]
    analysis = case.case.analysis
    highest = max([analysis.highest_harmonic, *(label.c for label in labels)])
    wanted = {
        "targets": Targets(modes=modes),
        "analysis": analysis.model_copy(update={"highest_harmonic": highest}),
    }
    return replace(case, case=case.case.model_copy(update=wanted))
