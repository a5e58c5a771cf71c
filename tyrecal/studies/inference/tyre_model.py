"""The evaluated tyre as a `ResponseModel`."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import log

import numpy as np

from ...errors import InputError
from ...simulate.deck.decks import Decks
from ...simulate.deck.decks_design import design_of
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import DeckRefused, EvaluationFailed, SolverUnavailable
from ...simulate.modes.find import LabelledModes, ModesAnswer, modes_in_order
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ...tyre.case.schema import TargetMode, Targets
from ...tyre.effects import catalogue
from ...tyre.number_units import EFFECT_PATH
from ...tyre.state import TyreState
from ...tyre.values import with_values
from .answer_rows import AnswerRows, ln_frequency
from .between import Between
from .compressed_cords import by_share, slack_layers, sources_of, with_compression
from .cord_coupling import cord_coupling
from .covariance import MATERIAL_LAWS
from .damping import loss_deviations, losses_in_words, with_losses, with_twice_the_loss
from .expansion import node_values
from .model import Answer, EffectRange, ModelRow, Query, state_of
from .model_designs import ModelDesigns
from .regions import SectionPart, count_numbers, regions
from .section_fields import OF_COMPOUNDS, SectionDesign, known_from
from .uncertainties import Source, values_of

Array = np.ndarray
WORTH_A_POOL = 10  # evaluations, for processes to be started

FIT_STEPS = 4  # of a calibration, as a rule

SAME_PARTS = 0.1  # of x, within which sensitivities by the section's parts are not evaluated again

QueryKey = tuple[bytes, tuple[tuple[str, float], ...], bool]  # of an evaluation


class TyreModel:
    """ln f of the modes ``rows`` (label, where), and ln mass where the label is None.

    case: its variables are x; found: sources of error; ranges: effects that may be evaluated, for
    which what slack cords bear is a source of error, too; jobs: evaluations at a time; damped:
    whether damping ratios are wanted, for which compounds without a loss factor get one. Where the
    solver gives no exact slopes, they are differences.
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
        self.designs = designs = ModelDesigns(case, values_of(case, own_sources))
        self.variables: Sequence[str] = designs.names
        self._slack = slack_layers(case) if ranges else []
        self._pressures = sorted({s.with_defaults(case).pressure_kPa or 0.0 for s in self.states})
        self.sources: Sequence[str] = [
            *(source.name for source in own_sources),
            *(name for layer in self._slack for name in sources_of(layer, self._pressures)),
        ]
        self.material_laws = 0.0 if known_from(case) == "exact" else MATERIAL_LAWS
        self.start, self.spread = designs.start, designs.spread
        self._slopeless = {id for id, span in ranges.items() if not self._has_slopes(id, span)}
        self.between = Between.of(self.rows, self.states)
        self._answer_rows = AnswerRows(
            self.between.rows, designs, own_sources, evaluator.solver.name
        )
        self._known_moves: dict[tuple[str, float], bool] = {}
        self._plain_answers: dict[bytes, Answer] = {}
        self._known_shares: dict[str, Array] = {}  # see `_loss_shares`
        self._known_parts: list[tuple[Array, list[SectionPart]]] = []
        self._known_compression: list[tuple[Array, Array]] = []

    def __getstate__(self) -> dict[str, object]:
        """In a worker, one evaluation at a time: the other workers have trials of their own."""
        return {**self.__dict__, "jobs": 1}

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
        if self._slack and any(map(_needs_constants, points)):
            runs += len(self.states) * (1 + len(self._slack))
        return runs

    @property
    def first_design(self) -> dict[str, float]:
        """The start in the first state."""
        return self.designs.in_state(self.states[0], self.designs.values(self.start))[0]

    @property
    def runs_of_calibration(self) -> int:
        """About how many runs a plain fit takes: steps, and the constants twice."""
        x = self.start
        steps = FIT_STEPS * self.runs([Query(x)])
        return 2 * self.runs([Query(x, constants=True)]) + steps

    def _queries(self, points: Sequence[Query]) -> tuple[list[Query], dict[QueryKey, Query]]:
        """The points, and by key all that has to be evaluated for them."""
        saves = bool(self.between.inner.any())
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
        designs = [self.designs.in_state(state, self.designs.values(x))[0] for state in self.states]
        for each in self.modes([(design, ()) for design in designs]):
            if not isinstance(each, LabelledModes):
                raise each
            answers.append(each)
        at = dict(zip(self.states, answers, strict=True))
        mass_kg = answers[0].evaluation.mass_kg
        return np.array(
            [
                ln_frequency(label, at[state_of(w)]) if label else log(mass_kg)
                for label, w in self.rows
            ]
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
            answer = self.between.filled(answer, plain)
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
            coupled = cord_coupling(self, point.x, answer.eta, constants)
            answer = replace(answer, coupling=coupled)
        if constants is not None and self._deviations and answer.damping is not None:
            shares = self._loss_shares(point.x, answer.damping)
            each = [np.outer(shares[name], own) for name, own in self._deviations.items()]
            answer = replace(answer, losses=np.sum(each, axis=0))
        answer = self._asked_rows(replace(answer, constants=constants))
        if self._slack and answer.constants is not None:
            both = [answer.constants, self._compression(point.x)]
            answer = replace(answer, constants=np.hstack(both))
        return answer

    def _compression(self, x: Array) -> Array:
        """Columns (n, k) of the layers of slack cords at x, or next to it. Of a layer with which no
        tyre is stable there, if it bears compression: those known before, else 0."""
        for there, columns in self._known_compression:
            if abs(x - there).max() < SAME_PARTS:
                return columns
        own, plain = with_values(self.case, self.designs.values(x)), self.values_at(x)
        states = [state_of(w) if label else TyreState(0.0) for label, w in self.rows]
        kPa = np.array([s.with_defaults(own).pressure_kPa or 0.0 for s in states])
        count = 1 + len(self._pressures)
        before = [columns for _, columns in self._known_compression[-1:]]
        columns = before[0].copy() if before else np.zeros((len(kPa), count * len(self._slack)))
        for k, layer in enumerate(self._slack):
            case = with_compression(own, layer)
            other = TyreModel(case, self.evaluator, self.rows, [], {}, self.jobs)
            try:
                shift = other.values_at(x) - plain
            except EvaluationFailed:
                continue
            columns[:, count * k : count * (k + 1)] = by_share(shift, kPa, self._pressures)
        self._known_compression.append((np.array(x), columns))
        return columns

    def _loss_shares(self, x: Array, damping: Array) -> Mapping[str, Array]:
        """Share (n,) of each compound in the loss of the modes, where it was first wanted.

        Damping ratios are linear in each loss factor, so that twice of it adds its share.
        """
        if len(self._deviations) == 1:
            return {name: np.ones(len(damping)) for name in self._deviations}
        for name in self._deviations.keys() - self._known_shares.keys():
            case, rows = with_twice_the_loss(self.case, name), self.between.rows
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
        own = with_values(self.case, {**self.designs.values(point.x), EFFECT_PATH + id: 0.0})
        add = catalogue()[id].shape_uncertainty
        assert add
        try:
            made = add(own, self.designs.present(id) + e)
        except ValueError:  # an effect from outside may raise one
            return None
        top = sorted(set(self.between.high.tolist()))
        rows = [self.between.rows[i] for i in top]
        try:
            shift = TyreModel(made, self.evaluator, rows, [], {}, self.jobs).values_at(point.x)
        except EvaluationFailed:
            return None
        return np.asarray((shift - eta[top])[np.searchsorted(top, self.between.high)])

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
            path, base = EFFECT_PATH + id, self.designs.present(id)
            try:
                design = self.evaluator.design.at({path: base + e})
                Decks(design, (path,)).tangents(self.evaluator.solver.dialect)
                self._known_moves[id, e] = True
            except InputError:
                self._known_moves[id, e] = False
        return self._known_moves[id, e]

    def _is_bare(self, point: Query) -> bool:
        return not self._slopeless.isdisjoint(point.effects)

    def _evaluated(self, points: Sequence[Query]) -> list[Answer | Exception]:
        """Distinct points, slopes with those that have them."""
        wanted, first = [], [0]
        for point in points:
            wanted += self._wanted(point)
            first.append(len(wanted))
        modes = self.modes(wanted)
        results = []
        for i, point in enumerate(points):
            here = slice(first[i], first[i + 1])
            results.append(self._answer(point, [design for design, _ in wanted[here]], modes[here]))
        return results

    def _wanted(self, point: Query) -> list[tuple[dict[str, float], tuple[str, ...]]]:
        """The point's design in each state, and the names of the slopes that are wanted there."""
        ids = {*point.slopes, *(self._sloped_sources if point.constants else ())}
        constants = (
            {**self.designs.constants, **dict.fromkeys(self._moved, 0.0)} if point.constants else {}
        )
        slopes = [EFFECT_PATH + id for id in sorted(ids)]
        names = dict.fromkeys((*self.variables, *constants, *slopes))
        if self.between.inner.any():
            names["pressure_kPa"] = None
        if self._is_bare(point):
            names = {}
        at_0 = {EFFECT_PATH + id: self.designs.present(id) for id in ids}
        design = {**constants, **at_0, **self.designs.at(point.x, point.effects)}
        return [
            self.designs.in_state(state, design, list(names)) for state in self._states_of(point)
        ]

    def _states_of(self, point: Query) -> Sequence[TyreState]:
        return self.states if point.near is None else self.between.ends

    def modes(
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
        answer = self._answer_rows.answer(point, at)
        smooth = self.between.inner.any() and not self._is_bare(point)
        return answer if smooth else replace(answer, by_pressure=None)


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
