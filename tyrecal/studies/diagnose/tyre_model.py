"""The evaluated tyre as a `ResponseModel`."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import product
from math import exp, log

import numpy as np

from ...simulate.deck.decks import Decks
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import DeckRefused, EvaluationFailed, SolverUnavailable
from ...simulate.modes.find import LabelledModes, ModesAnswer
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase, start_values
from ...tyre.case.schema import TargetMode, Targets
from ...tyre.effects import catalogue
from ...tyre.number_units import EFFECT_PATH, unit_of
from ...tyre.state import TyreState, without
from ...tyre.templates import TemplateFailed
from ...tyre.values import with_values
from ..fit import problem as fit
from ..fit.variable import read_variables
from .expansion import ONE_SIDED_SLOPED, node_values
from .form_error import MATERIAL_LAWS
from .model import Answer, Coupling, ModelRow, Query, Span, state_of
from .regions import regions
from .section_design import SectionDesign
from .section_fields import OF_COMPOUNDS, known_from
from .uncertainties import Source, values_of
from .veering import coupling, partner

Array = np.ndarray
WORTH_A_POOL = 10  # evaluations, for processes to be started

MAY_VEER = 0.15  # of ln f at some pressure, from which modes of one harmonic may veer

QueryKey = tuple[bytes, tuple[tuple[str, float], ...], bool, tuple[str, ...]]  # of an evaluation


class TyreModel:
    """ln f of the modes ``rows`` (label, where), and ln mass where the label is None.

    case: its variables are x; found: sources of error; spans: effects that may be asked for;
    jobs: evaluations at a time. Raises DeckRefused where the solver has no exact slopes.
    """

    def __init__(
        self,
        case: LoadedCase,
        evaluator: Evaluator,
        rows: Sequence[ModelRow],
        own_sources: list[Source],
        spans: Mapping[str, Span],
        jobs: int = 1,
    ):
        if not evaluator.has_gradients and "gradients" in evaluator.solver.capabilities:
            raise DeckRefused(
                "the solver gives no exact sensitivities of a case with a splice, and a diagnosis"
                " needs them: take the splice out of the case, the diagnosis considers it as an"
                " effect"
            )
        if not evaluator.has_gradients:
            raise DeckRefused(
                f"solver '{evaluator.solver.name}' gives no exact sensitivities, which a diagnosis"
                " needs:"
                " 'tyrecal solvers' shows which one does (gradients)"
            )
        self.rows, self.found, self.jobs = list(rows), own_sources, jobs
        self.spans: Mapping[str, Span] = spans
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
        self.evaluator = evaluator = evaluator.of(SectionDesign(case, self._moved))
        self._fit = fit.Problem(case, evaluator, jobs=jobs)
        self._variables = case.case.variables
        self.variables: Sequence[str] = list(self._variables)
        self.sources: Sequence[str] = [source.name for source in own_sources]
        self.material_laws = 0.0 if known_from(case) == "exact" else MATERIAL_LAWS
        self.start = np.array([self._scaled(n, v) for n, v in start_values(case).items()])
        self.spread = np.array([v.spread for v in read_variables(case)])
        self._plain = values_of(case, own_sources)
        self._plain.setdefault("pressure_kPa", case.case.pressure_kPa)
        self._slopeless = {id for id, span in spans.items() if not self._has_slopes(id, span)}

    @cached_property
    def sloped(self) -> Collection[str]:
        """Effects with whose parameter numbers of the decks change, and no keywords."""
        sizes = {
            id: map(float, node_values(span, ONE_SIDED_SLOPED)) for id, span in self.spans.items()
        }
        return {id for id in self.spans if id not in self._slopeless and self._moves(id, sizes[id])}

    @cached_property
    def sloped_at_0(self) -> Collection[str]:
        """The splice: to first order it is its share of the circumference, all round."""
        return {id for id in self._slopeless if self._moves(id, [0.0])}

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
        effects: one step of each, one way.
        """
        bare = [p for p in points if self._is_bare(p)]
        stepped = [p for p in points if p.constants]
        steps = [
            (k, path.removeprefix(EFFECT_PATH), step)
            for k, source in enumerate(self.found)
            for path, step in source.steps.items()
            if path.startswith(EFFECT_PATH)
        ]
        beside = [Query(p.x, {id: e}) for p in stepped for _, id, e in steps]
        queries = {_key(p): p for p in (*points, *(Query(p.x) for p in bare), *beside)}
        known = dict(zip(queries, self._evaluated(list(queries.values())), strict=True))
        return [self._completed(point, known, steps) for point in points]

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
        self,
        point: Query,
        known: Mapping[QueryKey, Answer | Exception],
        steps: Sequence[tuple[int, str, float]],
    ) -> Answer | Exception:
        """The answer with its slopes completed from other points."""
        answer = known[_key(point)]
        if point.coupled and isinstance(answer, Answer):
            answer = replace(answer, coupling=self._coupling(point.x, answer.eta))
        if isinstance(answer, Answer) and self._is_bare(point):
            plain = known[_key(Query(point.x))]
            if not isinstance(plain, Answer):
                return plain
            answer = replace(answer, jacobian=plain.jacobian)
        if point.beside and isinstance(answer, Answer):
            answer = replace(answer, beside=self._beside(point, answer.eta))
        if not point.constants or not isinstance(answer, Answer):
            return answer
        assert answer.constants is not None
        constants = answer.constants.copy()
        for k, id, e in steps:
            other = known[_key(Query(point.x, {id: e}))]
            if not isinstance(other, Answer):
                return other
            constants[:, k] += other.eta - answer.eta
        self._add_compounds(point.x, constants)
        return replace(answer, constants=constants)

    def _beside(self, point: Query, eta: Array) -> Array | None:
        """More eta (n,) by what else the nature of the point's effect leaves open; None where the
        case cannot have it. The tyre at x is written first, so that all is of its numbers."""
        ((id, e),) = point.effects.items()
        own = with_values(self.case, {**self.values(point.x), EFFECT_PATH + id: 0.0})
        add = catalogue()[id].beside
        assert add
        try:
            made = add(own, self._present.get(id, 0.0) + e)
        except ValueError:
            return None
        try:
            return self._of(made).values_at(point.x) - eta
        except EvaluationFailed:
            return None

    def _add_compounds(self, x: Array, constants: Array) -> None:
        """Fill in the columns of the compounds' fields, by the slopes of the section's parts."""
        known = [(k, each.field) for k, each in enumerate(self.found) if each.field]
        known = [(k, field) for k, field in known if field.kind in OF_COMPOUNDS]
        parts = [p for p in regions(self, x) if p.rubber] if known else []
        for k, field in known:
            slopes = [p.stiffness if field.kind == "stiffness" else p.mass for p in parts]
            constants[:, k] = np.array(slopes).T @ field.values

    def _of(self, case: LoadedCase) -> TyreModel:
        """Model of another tyre without sources of error or effects."""
        return TyreModel(case, self.evaluator, self.rows, [], {}, self.jobs)

    def _has_slopes(self, id: str, span: Span) -> bool:
        """Whether the solver gives slopes with an effect."""
        try:
            far = span.base + span.high or span.base + span.low
            return self.evaluator.has_gradients_at({EFFECT_PATH + id: far})
        except ValueError:  # the case cannot have that much of it
            return True

    def _moves(self, id: str, sizes: Iterable[float]) -> bool:
        """Whether numbers of the decks are all that changes with an effect, about each of the
        sizes. Not where waves part so far that the slope of a pair's mean is none of its geometric
        mean."""
        if catalogue()[id].needs == "rotation":
            return False
        path, base = EFFECT_PATH + id, self._present.get(id, 0.0)
        try:
            for e in sizes:
                design = self.evaluator.design.at({path: base + e})
                Decks(design, (path,)).tangents(self.evaluator.solver.dialect)
        except (ValueError, TemplateFailed):
            return False
        return True

    def _is_bare(self, point: Query) -> bool:
        return not self._slopeless.isdisjoint(point.effects)

    def _scaled(self, name: str, value: float) -> float:
        v = self._variables[name]
        return log(value) if v.scale == "log" else (value - v.lower) / (v.upper - v.lower)

    def _evaluated(self, points: Sequence[Query]) -> list[Answer | Exception]:
        """Distinct points, slopes with those that have them."""
        wanted = []
        constants = {**self._plain, **dict.fromkeys(self._moved, 0.0)}
        for point, state in product(points, self.states):
            known = constants if point.constants else {}
            slopes = [EFFECT_PATH + id for id in point.slopes]
            names = () if self._is_bare(point) else (*self.variables, *known, *slopes)
            at_0 = {EFFECT_PATH + id: self._present.get(id, 0.0) for id in point.slopes}
            wanted.append(self.in_state(state, {**known, **at_0, **self.design(point)}, names))
        modes = self._modes(wanted)
        per, results = len(self.states), []
        for i, point in enumerate(points):
            here = slice(i * per, (i + 1) * per)
            results.append(self._answer(point, [design for design, _ in wanted[here]], modes[here]))
        return results

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
        self._fit.jobs = self.jobs if len(wanted) >= WORTH_A_POOL else 1
        # the longest first, so that the last ones end together
        order = sorted(range(len(wanted)), key=lambda i: -self._effort(wanted[i][0]))
        answers = self._fit.modes_of([wanted[i] for i in order])
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
        labelled: list[LabelledModes] = []
        for each in answers:
            if isinstance(each, DeckRefused) and not point.effects:
                raise each
            if not isinstance(each, LabelledModes):
                return each
            labelled.append(each)
        at = dict(zip(self.states, zip(designs, labelled, strict=True), strict=True))
        eta, jacobian = np.zeros(len(self.rows)), np.zeros((len(self.rows), len(self.variables)))
        slopes, split = np.zeros((len(self.rows), len(self.found))), np.zeros(len(self.rows))
        by_effect = {id: np.full(len(self.rows), np.nan) for id in point.slopes}  # not the mass
        for i, (label, where) in enumerate(self.rows):
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
            for id, slope in by_effect.items():
                path = EFFECT_PATH + id  # a state may hold it at 0
                slope[i] = gradients[path][place] / f if path in gradients else 0.0
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
        return Answer(eta, jacobian, split, slopes if point.constants else None, by_effect)

    def _coupling(self, x: Array, eta: Array) -> Coupling | None:
        """Coupling by turned cords of modes that are near each other at x; other constants move
        modes, and couple hardly any. None where there are no such modes."""
        places = {row: i for i, row in enumerate(self.rows)}
        mates = np.array([places.get((partner(label), w), -1) for label, w in self.rows])
        near = {
            label
            for i, (label, _) in enumerate(self.rows)
            if mates[i] >= 0 and abs(eta[i] - eta[mates[i]]) < MAY_VEER
        }
        mates[[label not in near for label, _ in self.rows]] = -1
        turned = [s for s in self.found if any(unit_of(path) == "degrees" for path in s.steps)]
        if not near or not turned:
            return None
        own = {**self._plain, **self.values(x)}
        sides = [
            {**own, **{k: own[k] + side * step for k, step in source.steps.items() if k in own}}
            for source in turned
            for side in (1, -1)
        ]
        designs = [self.in_state(state, each) for each in sides for state in self.states]
        answers = iter(self._modes(designs))
        square, rise = np.zeros(len(self.rows)), np.zeros(len(self.rows))
        for _ in turned:
            ln_f = [eta.copy(), eta.copy()]
            for side, state in product((0, 1), self.states):
                answer = next(answers)
                if not isinstance(answer, LabelledModes):
                    raise answer
                for i, (label, where) in enumerate(self.rows):
                    if label and mates[i] >= 0 and state_of(where) == state:
                        ln_f[side][i] = log(answer.wanted[label].frequency_Hz)
            pairs = [np.array([values, values[mates]]) for values in (eta, *ln_f)]
            q, more = coupling(*pairs)
            square, rise = square + q**2, rise + q**2 * more
        size = np.where(mates >= 0, np.sqrt(square), 0.0)
        return Coupling(mates, size, np.where(size > 0, rise / np.maximum(square, 1e-300), 0.0))

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
    effects = tuple(point.effects.items())
    return point.x.tobytes(), effects, point.constants, point.slopes


def asked_for(case: LoadedCase, labels: Sequence[Label]) -> LoadedCase:
    """The case with the measured modes as targets, and enough harmonics for them."""
    modes = [TargetMode(c=x.c, m=x.m, kind=x.kind, frequency_Hz=1.0) for x in labels]  # type: ignore[arg-type]
    analysis = case.case.analysis
    highest = max([analysis.highest_harmonic, *(label.c for label in labels)])
    wanted = {
        "targets": Targets(modes=modes),
        "analysis": analysis.model_copy(update={"highest_harmonic": highest}),
    }
    return replace(case, case=case.case.model_copy(update=wanted))
