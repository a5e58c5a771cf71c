"""Shift of the modes by an effect, and the part of it that calibration would hide."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from ..simulate.evaluate.evaluator import Evaluator, Question
from ..simulate.evaluate.failure import EvaluationFailed
from ..simulate.evaluate.results import Evaluation
from ..simulate.modes.find import LabelledModes, modes_in_order
from ..simulate.modes.label import Label, Mode, paired_labels
from ..tyre.case import LoadedCase
from ..tyre.effects import catalogue
from ..tyre.state import pressure_name
from .fit.targets import target_labels

Array = np.ndarray


@dataclass(frozen=True)
class Signature:
    """An effect of one size at some pressures."""

    id: str
    value: float  # the effect's size, in its unit
    pressures_kPa: tuple[float, ...]
    labels: tuple[Label, ...]
    # (pressure, label) per cent of the plain tyre's frequency, NaN where a mode got lost
    before: Array
    after: Array  # the same after the best linear re-fit, without bounds, of the case's variables
    # share alpha = 1 - |after|^2 / |before|^2 that the re-fit absorbs, doublets counted twice, None
    # where the effect moves nothing
    absorbed: float | None
    refitted: dict[str, float]  # values of the variables after that re-fit
    mass_kg: float  # that the effect adds


class Plain:
    """The tyre without the effect at each pressure, with slopes by the case's variables.

    values: of the variables, in their own units; jobs: designs at a time. Raises what
    ``Evaluator.evaluate`` does.

    >>> from tyrecal.tyre.case import start_values
    >>> plain = Plain(case, evaluator, start_values(case), [240.0])
    >>> filler = plain.signature("bead_filler", 3.0)
    >>> f"{filler.before.max():.1f} % before, {filler.after.max():.1f} % after a new fit"
    '21.0 % before, 5.0 % after a new fit'
    """

    def __init__(
        self,
        case: LoadedCase,
        evaluator: Evaluator,
        values: Mapping[str, float],
        pressures_kPa: Sequence[float],
        jobs: int = 1,
    ):
        self.case, self.evaluator, self.pressures_kPa = case, evaluator, tuple(pressures_kPa)
        pressure = pressure_name(case)
        variables = case.case.variables
        self.names = tuple(name for name in values if name != pressure)
        self.values = dict(values)
        self.states = [{**values, pressure: p} for p in pressures_kPa]
        designs = [(state, self.names) for state in self.states]
        evaluations = []
        # no label is wanted: one that is not among the first modes at a pressure is left out
        for each in modes_in_order(evaluator, designs, [], jobs):
            if not isinstance(each, LabelledModes):
                raise each
            evaluations.append(each.evaluation)
        self.mass_kg = evaluations[0].mass_kg
        modes = [_modes(evaluation) for evaluation in evaluations]
        wanted = target_labels(case) or [m for m in modes[0] if m.m < 2]
        self.labels = tuple(label for label in wanted if all(label in each for each in modes))
        self.hertz = np.array([[m[label].frequency_Hz for label in self.labels] for m in modes])
        # (pressure, label) weights of residuals: in squares doublets count twice
        self.weights = np.sqrt([[m[label].multiplicity for label in self.labels] for m in modes])
        # a variable's step: all of it where it varies by factors, else its range
        self.steps = np.array(
            [
                values[name] if v.scale == "log" else v.upper - v.lower
                for name, v in ((name, variables[name]) for name in self.names)
            ]
        )
        slopes = [
            [[e.gradients[name][m[label].position] for name in self.names] for label in self.labels]
            for e, m in zip(evaluations, modes, strict=True)
        ]
        # (pressure, label, variable) d ln f by a step
        self.jacobian = np.array(slopes) * self.steps / self.hertz[:, :, None]

    def signature(self, id: str, value: float) -> Signature:
        """Signature of the effect on this tyre. Raises what ``Evaluator.evaluate`` does."""
        signature = next(self.signatures({id: value}))
        if isinstance(signature, EvaluationFailed):
            raise signature
        return signature

    def signatures(
        self, sizes: Mapping[str, float], jobs: int = 1
    ) -> Iterator[Signature | EvaluationFailed]:
        """Signature of each effect at its size, in their order; ``jobs`` designs at a time.

        Raises what ``Evaluator.evaluate_all`` does.
        """
        questions = [
            Question({**state, f"effects.{id}": value})
            for id, value in sizes.items()
            for state in self.states
        ]
        answers = self.evaluator.evaluate_all(questions, jobs)
        for id, value in sizes.items():
            evaluations: list[Evaluation] = []
            failed: list[EvaluationFailed] = []
            for answer in islice(answers, len(self.states)):
                if isinstance(answer, EvaluationFailed):
                    failed.append(answer)
                else:
                    evaluations.append(answer)
            try:
                yield failed[0] if failed else self._signature(id, value, evaluations)
            except EvaluationFailed as failure:
                yield failure

    def _signature(self, id: str, value: float, evaluations: list[Evaluation]) -> Signature:
        """Signature by the evaluations with the effect, one at each pressure."""
        lost = np.nan
        hertz = np.array(
            [
                [m[label].frequency_Hz if label in m else lost for label in self.labels]
                for m in map(_modes, evaluations)
            ]
        )
        change = np.log(hertz / self.hertz)
        there = ~np.isnan(change)
        if not there.any():
            raise EvaluationFailed("lost_label", f"no mode is left under the effect {id}")
        w = self.weights[there]
        J = self.jacobian[there] * w[:, None]
        step = np.linalg.lstsq(J, change[there] * w, rcond=None)[0]
        rest = change - self.jacobian @ step
        before, after = (float(np.sum((x[there] * w) ** 2)) for x in (change, rest))
        return Signature(
            id,
            value,
            self.pressures_kPa,
            self.labels,
            100 * np.expm1(change),
            100 * np.expm1(rest),
            1 - after / before if before else None,
            {name: self._moved(name, float(step[k]), k) for k, name in enumerate(self.names)},
            evaluations[0].mass_kg - self.mass_kg,
        )

    def _moved(self, name: str, step: float, place: int) -> float:
        """The variable after a step of the logarithm, or of its range."""
        value = self.values[name]
        if self.case.case.variables[name].scale == "log":
            return float(value * np.exp(step))
        return float(value + step * self.steps[place])


def stated_size(id: str, case: LoadedCase) -> float:
    """The end of an effect's range on this tyre that is further from 0."""
    low, high = catalogue()[id].range_on(case)
    return max(high, low, key=abs)


def rms(percent: Array) -> float:
    """Root mean square over all that is there."""
    return float(np.sqrt(np.nanmean(percent**2)))


def _modes(evaluation: Evaluation) -> dict[Label, Mode]:
    """Modes by label, one for each pair."""
    return {mode.label: mode for mode in paired_labels(evaluation.modes)}
