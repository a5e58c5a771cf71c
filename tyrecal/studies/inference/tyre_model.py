"""The evaluated tyre as a `ResponseModel`."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import islice
from math import exp, log

import numpy as np

from ...errors import InputError
from ...simulate.deck.decks import Decks
from ...simulate.deck.decks_design import design_of
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import DeckRefused, EvaluationFailed, SolverUnavailable
from ...simulate.modes.find import LabelledModes, ModesAnswer, modes_in_order
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase, start_values
from ...tyre.case.schema import TargetMode, Targets
from ...tyre.effects import catalogue
from ...tyre.number_units import EFFECT_PATH, unit_of
from ...tyre.state import TyreState, without
from ...tyre.values import with_values
from ..variable import read_variables
from .between import Between
from .expansion import node_values
from .form_error import MATERIAL_LAWS
from .losses import loss_deviations, losses_in_words, with_losses, with_twice_the_loss
from .model import Answer, Coupling, EffectRange, ModelRow, Query, state_of
from .regions import SectionPart, count_numbers, regions
from .section_design import SectionDesign
from .section_fields import OF_COMPOUNDS, known_from
from .uncertainties import Source, values_of
from .veering import coupling, partner

Array = np.ndarray
WORTH_A_POOL = 10  # evaluations, for processes to be started

MAY_VEER = 0.15  # of ln f at some pressure, from which modes of one harmonic may veer

FIT_STEPS = 4  # of a calibration, as a rule

SAME_PARTS = 0.1  # of x, within which sensitivities by the section's parts are not evaluated again

QueryKey = tuple[bytes, tuple[tuple[str, float], ...], bool]  # of an evaluation


class TyreModel:
    """ln f of the modes ``rows`` (label, where), and ln mass where the label is None.

    case: its variables are x; found: sources of error; ranges: effects that may be evaluated;
    jobs: evaluations at a time; damped: whether damping ratios are wanted, for which compounds
    without a loss factor get one. Where the solver gives no exact slopes, they are differences.
    """

    def __init__(
        self,
        case: LoadedCase,
        evaluator: Evaluator,
        rows: Sequence[ModelRow],
        own_sources: list[Source],
        ranges: Mapping[str, EffectRange],
        jobs: int = 1,
        damped: bool = False,
    ):
        self.losses = ""  # loss factors in words
        self._deviations: Mapping[str, Array] = {}  # of loss factors
        if damped:
            self.losses, self._deviations = losses_in_words(case), loss_deviations(case)
            case = with_losses(case)
        self.rows, self.found, self.jobs = list(rows), own_sources, jobs
        self.ranges: Mapping[str, EffectRange] = ranges
        self._present = case.case.effects
        found_in = {state_of(where) for label, where in rows if label}
        self.states = sorted(found_in, key=lambda s: (s.pressure_kPa, s.rim or "")) or [
            TyreState(case.case.pressure_kPa)
        ]
        labels = sorted({label for label, _ in rows if label}, key=str)
        case = asked_for(case, labels)
        self.case = case
        self._moved = {
            each.name: each.field for each in own_sources if each.field and each.field.moves
        }
        self.evaluator = evaluator = evaluator.of(
            SectionDesign(case, self._moved) if self._moved else design_of(case)
        )
        self._labels = labels
        self._variables = case.case.variables
        self.variables: Sequence[str] = list(self._variables)
        self.sources: Sequence[str] = [source.name for source in own_sources]
        self.material_laws = 0.0 if known_from(case) == "exact" else MATERIAL_LAWS
        self.start = np.array([self._scaled(n, v) for n, v in start_values(case).items()])
        self.spread = np.array([v.spread for v in read_variables(case)])
        self._plain = values_of(case, own_sources)
        self._plain.setdefault("pressure_kPa", case.case.pressure_kPa)
        self._slopeless = {id for id, span in ranges.items() if not self._has_slopes(id, span)}
        self._between = Between.of(self.rows, self.states)
        self._known_moves: dict[tuple[str, float], bool] = {}
        self._plain_answers: dict[bytes, Answer] = {}
        self._known_shares: dict[str, Array] = {}  # see `_loss_shares`
        self._known_parts: list[tuple[Array, list[SectionPart]]] = []

    @cached_property
    def sloped(self) -> Collection[str]:
        """Effects with whose parameter numbers of the decks change, and no keywords."""
        ends = {id: node_values(span, 1).tolist() for id, span in self.ranges.items()}
        able = [id for id in self.ranges if id not in self._slopeless]
        return {id for id in able if all(self._moves(id, e) for e in ends[id])}

    @cached_property
    def sloped_at_0(self) -> Collection[str]:
        """Effects that change numbers of the decks, and no keywords, from 0 on. A splice is to
        first order its share of the circumference, all round."""
        return {id for id in self.ranges if self._moves(id, 0.0)}

    @cached_property
    def _sloped_sources(self) -> Collection[str]:
        """Sources of error that are effects with exact sensitivities at 0; none without effects to
        weigh, because the standard errors of a fit are defined by the step."""
        if not self.ranges:
            return set()
        paths = {path for source in self.found for path in source.steps}
        ids = [path.removeprefix(EFFECT_PATH) for path in paths if path.startswith(EFFECT_PATH)]
        return {id for id in ids if self._moves(id, 0.0)}

    @cached_property
    def _steps(self) -> list[tuple[int, str, float]]:
        """Place, effect and step of the sources that are effects without sensitivities at 0."""
        return [
            (k, path.removeprefix(EFFECT_PATH), step)
            for k, source in enumerate(self.found)
            for path, step in source.steps.items()
            if path.startswith(EFFECT_PATH)
            and path.removeprefix(EFFECT_PATH) not in self._sloped_sources
        ]

    def values(self, x: Array) -> dict[str, float]:
        """Design variables at x, in their own units, bounds not enforced."""
        return {
            name: exp(xi) if v.scale == "log" else v.lower + xi * (v.upper - v.lower)
            for (name, v), xi in zip(self._variables.items(), map(float, x), strict=True)
        }

    def unit(self, variable: str) -> str:
        """The unit of a design variable, "" where it has none."""
        return unit_of(self._variables[variable].sets[0])

    def design(self, point: Query) -> dict[str, float]:
        """Numbers of the case at a point: variables, and effects on top of those that it has."""
        effects = {
            EFFECT_PATH + id: self._present.get(id, 0.0) + float(e)
            for id, e in point.effects.items()
        }
        return {**self.values(point.x), **effects}

    def answers(self, points: Sequence[Query]) -> list[Answer | Exception]:
        """Each point in every state, all in one batch, ``jobs`` evaluations at a time.

        A plain point that the solver refuses raises DeckRefused, a licence that is denied
        SolverUnavailable: what was answered is in the record. With an effect that it gives no
        slopes with, the plain tyre's at the same x stand for them. Slopes by sources that are
        effects without exact ones: one step of each, one way. The plain tyre is evaluated once at
        each x.
        """
        points, queries = self._queries(points)
        known: dict[QueryKey, Answer | Exception] = {}
        for key, p in queries.items():
            before = None if p.effects or key[2] else self._plain_answers.get(key[0])
            has_constants = before and (before.constants is not None or not p.constants)
            if before and has_constants and {*p.slopes} <= {*before.slopes}:
                known[key] = before
        fresh = {key: p for key, p in queries.items() if key not in known}
        for (key, p), answer in zip(fresh.items(), self._evaluated([*fresh.values()]), strict=True):
            known[key] = answer
            if isinstance(answer, Answer) and not p.effects and not key[2]:
                self._plain_answers[key[0]] = answer
        return [self._completed(point, known) for point in points]

    def runs(self, points: Sequence[Query]) -> int:
        """How many runs of the solver the points take, if none is recorded; without those of
        coupled modes."""
        wanted = [each for p in self._queries(points)[1].values() for each in self._wanted(p)]
        exact = self.evaluator.has_gradients
        runs = sum(1 if exact else 1 + len(names) for _, names in wanted)
        if self.has_uncertain_compounds and any(map(_needs_constants, points)):
            runs += len(self.states) * (1 + count_numbers(self.case))
        return runs

    @property
    def first_design(self) -> dict[str, float]:
        """The start in the first state."""
        return self.in_state(self.states[0], self.values(self.start))[0]

    @property
    def runs_of_calibration(self) -> int:
        """About how many runs a plain fit takes: steps, and the constants twice."""
        x = self.start
        steps = FIT_STEPS * self.runs([Query(x)])
        return 2 * self.runs([Query(x, constants=True)]) + steps

    def _queries(self, points: Sequence[Query]) -> tuple[list[Query], dict[QueryKey, Query]]:
        """The points, and by key all that has to be evaluated for them."""
        saves = bool(self._between.inner.any())
        points = [p if saves and _is_smooth(p) else replace(p, near=None) for p in points]
        more = [Query(p.x) for p in points if self._is_bare(p)]
        more += [Query(p.near) for p in points if p.near is not None]
        more += [
            Query(p.x, {id: e}) for p in points if _needs_constants(p) for _, id, e in self._steps
        ]
        queries: dict[QueryKey, Query] = {}
        for p in (*points, *more):
            queries[_key(p)] = self._joined(p, queries.get(_key(p), p))
        return points, queries

    def _joined(self, one: Query, other: Query) -> Query:
        """Both queries of one tyre in one; with the constants, all slopes that the plain tyre
        has."""
        constants = any(map(_needs_constants, (one, other)))
        slopes = {*one.slopes, *other.slopes}
        if not one.effects and self.evaluator.has_gradients:  # they cost next to nothing
            slopes |= {*self.sloped_at_0} if constants or slopes else set()
            constants = constants or bool(slopes)
        slopes = {id for id in slopes if self._moves(id, one.effects.get(id, 0.0))}
        return replace(one, constants=constants, slopes=tuple(sorted(slopes)))

    def values_at(self, x: Array) -> Array:
        """eta (n,) alone, without slopes. Raises DeckRefused, EvaluationFailed."""
        answers = []
        designs = [self.in_state(state, self.values(x))[0] for state in self.states]
        for each in self._modes([(design, ()) for design in designs]):
            if not isinstance(each, LabelledModes):
                raise each
            answers.append(each)
        at = dict(zip(self.states, answers, strict=True))
        mass_kg = answers[0].evaluation.mass_kg
        return np.array(
            [_ln(label, at[state_of(w)]) if label else log(mass_kg) for label, w in self.rows]
        )

    def _completed(
        self, point: Query, known: Mapping[QueryKey, Answer | Exception]
    ) -> Answer | Exception:
        """The answer with its slopes completed from other points."""
        answer = known[_key(point)]
        if not isinstance(answer, Answer):
            return answer
        if point.near is not None:
            plain = known[_key(Query(point.near))]
            if not isinstance(plain, Answer):
                return plain
            answer = self._between.filled(answer, plain)
        if self._is_bare(point):
            plain = known[_key(Query(point.x))]
            if not isinstance(plain, Answer):
                return plain
            answer = replace(answer, jacobian=plain.jacobian)
        if point.shape_uncertainty:
            answer = replace(answer, shape_uncertainty=self._shape_uncertainty(point, answer.eta))
        constants = None
        if _needs_constants(point):
            assert answer.constants is not None
            constants = answer.constants.copy()
            for k, id, e in self._steps:
                other = known[_key(Query(point.x, {id: e}))]
                if not isinstance(other, Answer):
                    return other
                constants[:, k] += other.eta - answer.eta
            self._add_compounds(point.x, constants)
        if point.coupled and constants is not None:
            coupled = self._coupling(point.x, answer.eta, constants)
            answer = replace(answer, coupling=coupled)
        if constants is not None and self._deviations and answer.damping is not None:
            shares = self._loss_shares(point.x, answer.damping)
            each = [np.outer(shares[name], own) for name, own in self._deviations.items()]
            answer = replace(answer, losses=np.sum(each, axis=0))
        return self._asked_rows(replace(answer, constants=constants))

    def _loss_shares(self, x: Array, damping: Array) -> Mapping[str, Array]:
        """Share (n,) of each compound in the loss of the modes, where it was first wanted.

        Damping ratios are linear in each loss factor, so that twice of it adds its share.
        """
        if len(self._deviations) == 1:
            return {name: np.ones(len(damping)) for name in self._deviations}
        for name in self._deviations.keys() - self._known_shares.keys():
            case, rows = with_twice_the_loss(self.case, name), self._between.rows
            (twice,) = TyreModel(case, self.evaluator, rows, [], {}, self.jobs).answers([Query(x)])
            if not isinstance(twice, Answer):
                raise twice
            self._known_shares[name] = np.expm1(twice.damping - damping)
        return self._known_shares

    def _asked_rows(self, answer: Answer) -> Answer:
        """The answer without the rows that only serve to interpolate."""
        n = len(self.rows)
        cut = lambda each: None if each is None else each[:n]
        return replace(
            answer,
            eta=answer.eta[:n],
            jacobian=answer.jacobian[:n],
            split=answer.split[:n],
            constants=cut(answer.constants),
            slopes={id: slope[:n] for id, slope in answer.slopes.items()},
            shape_uncertainty=cut(answer.shape_uncertainty),
            by_pressure=cut(answer.by_pressure),
            damping=cut(answer.damping),
            losses=cut(answer.losses),
        )

    def _shape_uncertainty(self, point: Query, eta: Array) -> Array | None:
        """More eta (n,) by what else the nature of the point's effect leaves open, evaluated at the
        highest pressure; None where the case cannot have it. The tyre at x is written first, so
        that all is of its numbers."""
        ((id, e),) = point.effects.items()
        own = with_values(self.case, {**self.values(point.x), EFFECT_PATH + id: 0.0})
        add = catalogue()[id].shape_uncertainty
        assert add
        try:
            made = add(own, self._present.get(id, 0.0) + e)
        except ValueError:  # an effect from outside may raise one
            return None
        top = sorted(set(self._between.high.tolist()))
        rows = [self._between.rows[i] for i in top]
        try:
            shift = TyreModel(made, self.evaluator, rows, [], {}, self.jobs).values_at(point.x)
        except EvaluationFailed:
            return None
        return np.asarray((shift - eta[top])[np.searchsorted(top, self._between.high)])

    def _add_compounds(self, x: Array, constants: Array) -> None:
        """Fill in the columns of the compounds' fields, by the slopes of the section's parts."""
        known = [(k, each.field) for k, each in enumerate(self.found) if each.field]
        known = [(k, field) for k, field in known if field.kind in OF_COMPOUNDS]
        parts = [p for p in self.parts(x) if p.rubber] if known else []
        for k, field in known:
            slopes = [p.stiffness if field.kind == "stiffness" else p.mass for p in parts]
            constants[: len(self.rows), k] = np.array(slopes).T @ field.values

    @property
    def has_uncertain_compounds(self) -> bool:
        """Whether stiffness or density of the section's parts are sources of error."""
        return any(each.field and each.field.kind in OF_COMPOUNDS for each in self.found)

    def parts(self, x: Array) -> list[SectionPart]:
        """The parts of the section at x, or where they are known next to it."""
        for there, parts in self._known_parts:
            if abs(x - there).max() < SAME_PARTS:
                return parts
        self._known_parts.append((np.array(x), regions(self, x)))
        return self._known_parts[-1][1]

    def _has_slopes(self, id: str, span: EffectRange) -> bool:
        """Whether the solver gives slopes with an effect."""
        if not self.evaluator.has_gradients:
            return True  # by differences
        try:
            far = span.base + span.high or span.base + span.low
            return self.evaluator.has_gradients_at({EFFECT_PATH + id: far})
        except InputError:  # the case cannot have that much of it
            return True

    def _moves(self, id: str, e: float) -> bool:
        """Whether numbers of the decks are all that changes with an effect about the size e. Not
        where waves part so far that the slope of a pair's mean is none of its geometric mean."""
        if catalogue()[id].needs == "rotation" or (e and id in self._slopeless):
            return False
        if (id, e) not in self._known_moves:
            path, base = EFFECT_PATH + id, self._present.get(id, 0.0)
            try:
                design = self.evaluator.design.at({path: base + e})
                Decks(design, (path,)).tangents(self.evaluator.solver.dialect)
                self._known_moves[id, e] = True
            except InputError:
                self._known_moves[id, e] = False
        return self._known_moves[id, e]

    def _is_bare(self, point: Query) -> bool:
        return not self._slopeless.isdisjoint(point.effects)

    def _scaled(self, name: str, value: float) -> float:
        v = self._variables[name]
        return log(value) if v.scale == "log" else (value - v.lower) / (v.upper - v.lower)

    def _evaluated(self, points: Sequence[Query]) -> list[Answer | Exception]:
        """Distinct points, slopes with those that have them."""
        wanted, first = [], [0]
        for point in points:
            wanted += self._wanted(point)
            first.append(len(wanted))
        modes = self._modes(wanted)
        results = []
        for i, point in enumerate(points):
            here = slice(first[i], first[i + 1])
            results.append(self._answer(point, [design for design, _ in wanted[here]], modes[here]))
        return results

    def _wanted(self, point: Query) -> list[tuple[dict[str, float], tuple[str, ...]]]:
        """The point's design in each state, and the names of the slopes that are wanted there."""
        ids = {*point.slopes, *(self._sloped_sources if point.constants else ())}
        constants = {**self._plain, **dict.fromkeys(self._moved, 0.0)} if point.constants else {}
        slopes = [EFFECT_PATH + id for id in sorted(ids)]
        names = dict.fromkeys((*self.variables, *constants, *slopes))
        if self._between.inner.any():
            names["pressure_kPa"] = None
        if self._is_bare(point):
            names = {}
        at_0 = {EFFECT_PATH + id: self._present.get(id, 0.0) for id in ids}
        design = {**constants, **at_0, **self.design(point)}
        return [self.in_state(state, design, list(names)) for state in self._states_of(point)]

    def _states_of(self, point: Query) -> Sequence[TyreState]:
        return self.states if point.near is None else self._between.ends

    def in_state(
        self, state: TyreState, design: Mapping[str, float], names: Sequence[str] = ()
    ) -> tuple[dict[str, float], tuple[str, ...]]:
        """A design in a state, which wins over an effect that holds the rim otherwise, and those
        of the slopes ``names`` that it has there."""
        held = replace(state, pressure_kPa=None).numbers(self.case)
        pressure = state.with_defaults(self.case).pressure_kPa or 0.0
        left = without(self.case, dict.fromkeys(names, 0.0), held)
        there = {**without(self.case, design, held), "pressure_kPa": pressure, **held}
        return there, tuple(name for name in left if name not in held)

    def _modes(
        self, wanted: Sequence[tuple[dict[str, float], tuple[str, ...]]]
    ) -> list[ModesAnswer]:
        """Labelled modes of designs, each with the names of which sensitivities are wanted. Raises
        SolverUnavailable."""
        runs = len(wanted)
        if not self.evaluator.has_gradients:
            runs += sum(len(names) for _, names in wanted)
        jobs = self.jobs if runs >= WORTH_A_POOL else 1
        # the longest first, so that the last ones end together
        order = sorted(range(len(wanted)), key=lambda i: -self._effort(wanted[i][0]))
        ordered = [wanted[i] for i in order]
        answers = modes_in_order(self.evaluator, ordered, self._labels, jobs)
        for each in answers:
            if isinstance(each, EvaluationFailed) and each.denied:
                raise SolverUnavailable(str(each))
        return [answers[place] for place in np.argsort(order)]

    def _effort(self, design: Mapping[str, float]) -> int:
        """How long an evaluation takes, by its effects: 2 without slopes, 1 where it needs more
        than a plain tyre's modes."""
        ids = {name.removeprefix(EFFECT_PATH) for name in design if name.startswith(EFFECT_PATH)}
        if not self._slopeless.isdisjoint(ids):
            return 2
        return int(any(catalogue()[id].needs for id in ids))

    def _answer(
        self, point: Query, designs: list[dict[str, float]], answers: Sequence[ModesAnswer]
    ) -> Answer | Exception:
        """Answer of one query from the modes of its designs, one for each state; or why there is
        none."""
        labelled: list[LabelledModes] = []
        for each in answers:
            if isinstance(each, DeckRefused) and not point.effects:
                raise each
            if not isinstance(each, LabelledModes):
                return each
            labelled.append(each)
        at = dict(zip(self._states_of(point), zip(designs, labelled, strict=True), strict=True))
        rows = self._between.rows
        eta, jacobian = np.zeros(len(rows)), np.zeros((len(rows), len(self.variables)))
        slopes, split = np.zeros((len(rows), len(self.found))), np.zeros(len(rows))
        by_pressure, damping = np.zeros(len(rows)), np.full(len(rows), np.nan)
        by_effect = {id: np.full(len(rows), np.nan) for id in point.slopes}  # not the mass
        for i, (label, where) in enumerate(rows):
            if label and state_of(where) not in at:
                continue  # between the ends
            if label is None:
                eta[i] = log(labelled[0].evaluation.mass_kg)
                jacobian[i], slopes[i] = self._mass_slopes(point.x, labelled)
                continue
            design, answer = at[state_of(where)]
            gradients, modes = answer.evaluation.gradients, answer.wanted
            f, place = modes[label].frequency_Hz, modes[label].position
            eta[i] = _ln(label, answer)
            if members := modes[label].raw.members:
                split[i] = log(members[1] / members[0])
            if ratio := modes[label].raw.damping_ratio:
                damping[i] = log(ratio)
            for id, slope in by_effect.items():
                path = EFFECT_PATH + id  # a state may hold it at 0
                slope[i] = gradients[path][place] / f if path in gradients else 0.0
            if "pressure_kPa" in gradients:
                by_pressure[i] = gradients["pressure_kPa"][place] * design["pressure_kPa"] / f
            for j, name in enumerate(self.variables):
                if name in gradients:
                    jacobian[i, j] = gradients[name][place] * self._slope(name, design) / f
            if point.constants:
                for k, source in enumerate(self.found):
                    slopes[i, k] = sum(
                        step * gradients[path][place] / f
                        for path, step in _steps(source).items()
                        if path in gradients
                    )
        known = by_pressure if self._between.inner.any() and not self._is_bare(point) else None
        return Answer(
            eta,
            jacobian,
            split,
            slopes if point.constants else None,
            by_effect,
            by_pressure=known,
            damping=None if np.isnan(damping).all() else damping,
        )

    def _coupling(self, x: Array, eta: Array, constants: Array) -> Coupling | None:
        """Coupling by turned cords of modes that are near each other at x; other constants move
        modes, and couple hardly any. None where there are no such modes.

        One step of each, to the other side where that has no solution, at the lowest and the
        highest pressure.
        """
        rows, count = self._between.rows, len(self.rows)
        places = {(label, state_of(w) if label else w): i for i, (label, w) in enumerate(rows)}
        mates = np.array([places.get((partner(x), state_of(w)), -1) if x else -1 for x, w in rows])
        near = {
            label
            for i, (label, _) in enumerate(rows)
            if mates[i] >= 0 and abs(eta[i] - eta[mates[i]]) < MAY_VEER
        }
        mates[[label not in near for label, _ in rows]] = -1
        turned = {
            k: source
            for k, source in enumerate(self.found)
            if any(unit_of(path) == "degrees" for path in source.steps)
        }
        if not near or not turned:
            return None
        own, ends = {**self._plain, **self.values(x)}, self._between.ends

        def moved(source: Source, side: float) -> list[tuple[dict[str, float], tuple[str, ...]]]:
            steps = {k: own[k] + side * step for k, step in source.steps.items() if k in own}
            return [self.in_state(state, {**own, **steps}) for state in ends]

        answers = iter(self._modes([each for s in turned.values() for each in moved(s, 1.0)]))
        square, rise = np.zeros(len(rows)), np.zeros(len(rows))
        for k, source in turned.items():
            side, here = 1.0, list(islice(answers, len(ends)))
            if not all(isinstance(answer, LabelledModes) for answer in here):
                side, here = -1.0, self._modes(moved(source, -1.0))
            ln_f = eta.copy()
            for state, answer in zip(ends, here, strict=True):
                if not isinstance(answer, LabelledModes):
                    raise answer
                for i, (label, where) in enumerate(rows):
                    if label and mates[i] >= 0 and state_of(where) == state:
                        ln_f[i] = log(answer.wanted[label].frequency_Hz)
            slope = side * constants[:, k]
            q, more = coupling(*(np.array([v, v[mates]]) for v in (eta, slope, ln_f)))
            square, rise = square + q**2, rise + q**2 * more
        square, rise = (self._between.straight(each) for each in (square, rise))
        size = np.where(mates >= 0, np.sqrt(square), 0.0)[:count]
        rise = np.where(size > 0, rise[:count] / np.maximum(square[:count], 1e-300), 0.0)
        return Coupling(np.where(mates < count, mates, -1)[:count], size, rise)

    def _mass_slopes(self, x: Array, labelled: Sequence[LabelledModes]) -> tuple[Array, Array]:
        """d ln mass by x (v,) and by the sources of error (k,). Raises DeckRefused where the solver
        does not give them."""
        mass_kg, values, rates = labelled[0].evaluation.mass_kg, self.values(x), dict[str, float]()
        for each in labelled:  # a number that one state sets moves the mass in the others
            rates |= each.evaluation.mass_gradients
            if each.evaluation.gradients.keys() != each.evaluation.mass_gradients.keys():
                raise DeckRefused(
                    f"solver '{self.evaluator.solver.name}' gives no sensitivities of the mass,"
                    " which was measured"
                )
        by_x = [rates.get(name, 0.0) * self._slope(name, values) for name in self.variables]
        by_source = [
            sum(step * rates.get(path, 0.0) for path, step in _steps(source).items())
            for source in self.found
        ]
        return np.array(by_x) / mass_kg, np.array(by_source) / mass_kg

    def _slope(self, name: str, design: Mapping[str, float]) -> float:
        v = self._variables[name]
        return design[name] if v.scale == "log" else v.upper - v.lower


def _ln(label: Label, labelled: LabelledModes) -> float:
    """ln f of a mode, of a pair the mean."""
    mode = labelled.wanted[label]
    members = mode.raw.members
    return log(members[0] * members[1]) / 2 if members else log(mode.frequency_Hz)


def _steps(source: Source) -> Mapping[str, float]:
    """Steps of numbers by path, or of the field of the section that the source is."""
    return {source.name: 1.0} if source.field else source.steps


def _key(point: Query) -> QueryKey:
    """Key that distinguishes two points."""
    return point.x.tobytes(), tuple(point.effects.items()), point.near is not None


def _is_smooth(point: Query) -> bool:
    """Whether shifts change smoothly with the pressure: not where harmonics are coupled, or waves
    part, and modes come near each other at some pressure."""
    return not any(catalogue()[id].needs in ("coupled", "rotation") for id in point.effects)


def _needs_constants(point: Query) -> bool:
    """Whether a query needs the sensitivities by the sources of error."""
    return point.constants or point.coupled


def asked_for(case: LoadedCase, labels: Sequence[Label]) -> LoadedCase:
    """The case with the modes of these labels as targets, and enough harmonics for them; the
    targets' frequencies, 1 Hz, count for nothing."""
    modes = [TargetMode(c=x.c, m=x.m, kind=x.kind, frequency_Hz=1.0) for x in labels]  # type: ignore[arg-type]
    analysis = case.case.analysis
    highest = max([analysis.highest_harmonic, *(label.c for label in labels)])
    wanted = {
        "targets": Targets(modes=modes),
        "analysis": analysis.model_copy(update={"highest_harmonic": highest}),
    }
    return replace(case, case=case.case.model_copy(update=wanted))
