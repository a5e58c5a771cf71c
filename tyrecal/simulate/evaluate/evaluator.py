"""Evaluations: a design goes in, modes, footprints or a typed failure come out."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ...errors import InputError
from ...files import Json, NotWritten, printable
from ...interrupt import defer_interrupts, raise_interrupt
from ..deck.decks import Decks, Design, DesignKey, PressedTyre
from . import folders
from .executor import executor, in_order
from .failure import DeckRefused, EvaluationFailed
from .pressed import Pressed, pressed
from .record import Damaged
from .recorded import check, contradiction
from .results import Evaluation, evaluation
from .solver import Solver, SolverAnswer, find_solver, refuse_missing_program
from .store import Store, key_of

SETTLED = ("no_equilibrium", "unstable")  # the deck's own doing: another run would say the same
DIFFERENCE_STEP = 1e-4  # of a logarithm: best between truncation and most solvers' digits
MODES_ON_TOP = 3  # times the time limit of a load, where modes are sought there too
T = TypeVar("T")
Array = np.ndarray
# what a tyre on the road was asked for: its design, its loads, N, and the variables of its slopes
PressedKey = tuple[DesignKey, tuple[float, ...], tuple[str, ...]]
RESPONDS_NOT = {"frequency_modulus", "cavity", "coupled", "rotation"}  # needs of a tyre


@dataclass(frozen=True)
class Question:
    """One design to evaluate: values of variables or of any number of the case, by name or path.

    Variables that are not in ``values`` have their start values, so {} is the start design.
    gradients: names of variables for sensitivities; modes_per_harmonic: None = the case's;
    response: responses to a force on the tread, as the solver's contract has them.
    """

    values: Mapping[str, float]
    gradients: tuple[str, ...] = ()
    modes_per_harmonic: int | None = None
    response: Mapping[str, Any] | None = None


class PressQuestion(NamedTuple):
    """One design on the road; the fields are the arguments of `Evaluator.press`."""

    values: Mapping[str, float]
    loads_N: Sequence[float]
    modes: int = 0
    gradients: tuple[str, ...] = ()
    base: Mapping[str, float] | None = None
    rim_stiffness: bool = False
    response: Mapping[str, Any] | None = None


class ResponseAnswer(NamedTuple):
    """Responses of a design, as `Solver.read` has them, and its state."""

    pressure_kPa: float
    response: Mapping[str, Any]
    deflection_m: float = 0.0


@dataclass
class Counts:
    """How often the solver ran, and how often the record answered instead."""

    runs: int = 0
    recorded: int = 0

    def add(self, other: Counts) -> None:
        """Count what another process did."""
        self.runs, self.recorded = self.runs + other.runs, self.recorded + other.recorded


def _unwatched(done: int, total: int) -> None:
    """Ignore progress."""


@dataclass
class Evaluator:
    """Evaluates a design, and others of the same tyre, each in a fresh folder."""

    design: Design
    solver_name: str = ""  # else the design's
    folder: Path | None = None  # of the run folders; None: temporary ones
    keep: bool = False  # the folders of successful runs too; those of failures always are
    store: Store | None = None  # answers of earlier runs: read before a run, written after it
    scheduler: str = ""  # address of a Dask scheduler for several questions, else processes
    command: tuple[str, ...] = ()  # words that start the solver's program, else the user's settings
    counts: Counts = field(default_factory=Counts)
    # called with how many of how many designs asked at once are answered
    on_progress: Callable[[int, int], None] = field(default=_unwatched, repr=False)
    # of nominal designs: node numbers and displacements, see `_start_of`
    shapes: dict[DesignKey, Array] = field(default_factory=dict, repr=False)
    # see `_pressed`; None: it cannot bear the first load
    pressed_tyres: dict[PressedKey, PressedTyre | None] = field(default_factory=dict, repr=False)
    _solver: Solver | None = field(default=None, repr=False)

    @property
    def solver(self) -> Solver:
        """The adapter. Raises InputError."""
        if self._solver is None:
            name = self.solver_name or self.design.solver.name
            self._solver = find_solver(name, self.command)
        return self._solver

    @property
    def has_gradients(self) -> bool:
        """Whether the solver gives exact slopes of the design."""
        return self.design.has_slopes and "gradients" in self.solver.capabilities

    @property
    def difference_step(self) -> float | None:
        """Step of a logarithm for sensitivities by differences, which suits the solver's digits;
        None where it gives exact ones."""
        exact = self.has_gradients
        return None if exact else getattr(self.solver, "difference_step", DIFFERENCE_STEP)

    def has_gradients_at(self, values: Mapping[str, float]) -> bool:
        """`has_gradients` of the design with values of variables or effects."""
        return self.of(self.design.at(values)).has_gradients

    def evaluate(self, question: Question) -> Evaluation:
        """Modes of one design, the same from the record as from a run.

        Raises EvaluationFailed; DeckRefused, TemplateFailed, CaseError where the input is wrong;
        OSError where the run folder cannot be written.
        """
        design = self._with(question.values)
        start = self._start_of(design)
        wanted = question.gradients, question.modes_per_harmonic
        decks = Decks(design, *wanted, start=start, response=question.response)
        try:
            result = self._ask(decks, lambda answer, kept: evaluation(answer))
        except EvaluationFailed as failure:
            raise _advised(failure, design) from None
        if design.is_nominal and (nominal := design.nominal):
            self.shapes.setdefault(_key(nominal), _shape(result))
        return result

    def respond(
        self, values: Mapping[str, float], request: Mapping[str, Any], load_N: float = 0.0
    ) -> ResponseAnswer:
        """Responses of a design, unloaded on the case's rim, or pressed on the road with
        ``load_N``, its rim and patch held. Raises what `evaluate` and `press` do."""
        self.needs_response(rim_held=bool(load_N) or "modes" in request)
        if not load_N:
            result = self.evaluate(Question(values, response=request))
            return ResponseAnswer(result.pressure_kPa, result.response)
        pressed = self.press(values, [load_N], response=request)
        (footprint,) = pressed.footprints
        assert footprint.response is not None
        return ResponseAnswer(pressed.pressure_kPa, footprint.response, footprint.deflection_m)

    def _start_of(self, design: Design) -> Array | None:
        """Inflated shape (n, 4) from which a design's inflation starts: that of its nominal design,
        which is evaluated first, so that the answer depends on no other question. None: at rest, as
        for the nominal design itself, and for all where it does not inflate."""
        nominal = None if design.is_nominal else design.nominal
        return self._inflated(nominal) if nominal else None

    def _inflated(self, nominal: Design) -> Array | None:
        """Shape (n, 4), node number and displacement in m, of the nominal tyre to start from; None
        if there is none."""
        if "start" not in self.solver.capabilities:
            return None
        if (key := _key(nominal)) not in self.shapes:
            other = replace(self.of(nominal), folder=None, keep=False)
            try:
                self.shapes[key] = _shape(other.evaluate(Question(nominal.values)))
            except (EvaluationFailed, DeckRefused):
                self.shapes[key] = np.empty((0, 4))
        shape = self.shapes[key]
        return shape if len(shape) else None

    def press(
        self,
        values: Mapping[str, float],
        loads_N: Sequence[float],
        modes: int = 0,
        gradients: tuple[str, ...] = (),
        base: Mapping[str, float] | None = None,
        rim_stiffness: bool = False,
        response: Mapping[str, Any] | None = None,
    ) -> Pressed:
        """One design on the road at rising loads, as far as the solver gets, with so many ``modes``
        at each; gradients: names of variables whose slopes are wanted (`Footprint.slopes`); base:
        values of the design at whose states on the road the loads begin (None: the inflated
        tyre); rim_stiffness: that of the rim is wanted at each load, too;
        response: in place of modes, responses there.

        Raises what `evaluate` does; DeckRefused too where the solver has no road.
        """
        vibrates = modes or bool(response)
        self.needs_road(bool(vibrates), rim_stiffness)
        design, loads = self._with(values), tuple(loads_N)
        start = None
        if base and not (vibrates or rim_stiffness) and _key(self._with(base)) != _key(design):
            start = self._pressed(base, loads, gradients)
            start = start and start.predicted(design.values)
        decks = Decks(
            design,
            gradients,
            loads_N=loads,
            loaded_modes=int(vibrates),
            response=response,
            pressed_start=start,
            rim_stiffness=rim_stiffness,
        )
        try:
            answer = self._ask(
                decks, lambda answer, kept: pressed(answer, loads_N, kept, modes, rim_stiffness)
            )
        except EvaluationFailed as failure:
            raise _advised(failure, design) from None
        if answer.failed:
            answer = replace(answer, failed=_advised(answer.failed, design))
        if base:
            self._remember((_key(design), loads, gradients), answer)
        return answer

    def _pressed(
        self, base: Mapping[str, float], loads: tuple[float, ...], gradients: tuple[str, ...]
    ) -> PressedTyre | None:
        """The design ``base`` on the road, from which others begin at each load. It is pressed
        before them, so that their answers depend on no other question; with their ``gradients``, so
        that its own answer is recorded only once. None where it bears no load, or the solver
        cannot begin from it."""
        if "pressed_start" not in self.solver.capabilities:
            return None
        design = self._with(base)
        key = _key(design), loads, gradients
        if key not in self.pressed_tyres:
            self.pressed_tyres[key] = None
            with contextlib.suppress(EvaluationFailed):
                self._remember(key, self.press(base, loads, gradients=gradients))
        return self.pressed_tyres[key]

    def _remember(self, key: PressedKey, answer: Pressed) -> None:
        """Keep a tyre on the road for those that begin from it."""
        if "pressed_start" not in self.solver.capabilities:
            return
        at = answer.footprints
        (_, _, of_design), _, _ = key
        values, moved = dict(of_design), [each.displacement_slopes for each in at]
        slopes = {
            name: (
                values[name],
                np.array([each[i] for each in moved if each is not None]),
                np.array([each.slopes[name]["deflection_m"] for each in at]),
            )
            for i, name in enumerate(at[0].slopes)
            if all(each is not None for each in moved)
        }
        self.pressed_tyres[key] = PressedTyre(
            answer.nodes,
            np.array([each.displacement for each in at]),
            np.array([each.load_N for each in at]),
            np.array([each.deflection_m for each in at]),
            slopes,
        )

    def needs_road(self, modes: bool = False, rim_stiffness: bool = False) -> None:
        """Raises DeckRefused where the solver cannot press a tyre on a road, or has no modes or
        stiffness of its rim there."""
        wanted = {
            "footprint": ("press a tyre", not (modes or rim_stiffness)),
            "loaded_modes": ("find modes of a tyre", modes),
            "rim_stiffness": ("find the stiffness of a tyre", rim_stiffness),
        }
        for capability, (what, is_wanted) in wanted.items():
            if not is_wanted or capability in self.solver.capabilities:
                continue
            raise DeckRefused(
                f"solver '{self.solver.name}' cannot {what} on a road; 'tyrecal solvers'"
                f" shows which one can ({capability})"
            )

    def needs_response(self, rim_held: bool = False) -> None:
        """Raises DeckRefused where the solver computes no responses, or none of such a tyre."""
        if "response" not in self.solver.capabilities:
            raise DeckRefused(
                f"solver '{self.solver.name}' computes no response functions; 'tyrecal solvers'"
                " shows which one can (response)"
            )
        for need, words in self.design.needs.items():
            if need in RESPONDS_NOT or (rim_held and need == "spindle"):
                raise DeckRefused(
                    "response functions are of a tyre that is the same all round, without gas; on"
                    " the road and as matrices, on a rim that is held: the case has"
                    f" {words.partition(';')[0]}"
                )

    def refuse_lacking(self, design: Design) -> None:
        """Raises DeckRefused where the solver cannot express what the design has."""
        for need, lack in design.needs.items():
            if need not in self.solver.capabilities:
                raise DeckRefused(f"solver '{self.solver.name}' cannot express {lack}")

    def _with(self, values: Mapping[str, float]) -> Design:
        """The design with values of variables. Raises EvaluationFailed if there is no such tyre, or
        InputError."""
        try:
            design = self.design.at(values)
        except InputError as error:  # no such tyre: the optimiser steps back from it
            raise EvaluationFailed("refused", str(error)) from None
        self.refuse_lacking(design)
        return design

    def _ask(self, decks: Decks, typed: Callable[[SolverAnswer, Path | None], T]) -> T:
        """The solver's answer, or the record's, ``typed``, which is told where a run that ended
        early is kept."""
        raise_interrupt()
        folder: Path | None = None
        try:
            with defer_interrupts():  # it must not come between the folder and its name
                folder = folders.fresh(self.folder)
            return self._ask_in(folder, decks, typed)
        except KeyboardInterrupt:
            if folder:
                folders.drop(folder)
            raise

    def _ask_in(
        self, folder: Path, decks: Decks, typed: Callable[[SolverAnswer, Path | None], T]
    ) -> T:
        """`_ask` in a fresh ``folder``, which is dropped where the run went well."""
        solver, key = self.solver, ""
        kept: Path | None = None
        try:
            solver.write(decks, folder)
            if self.store:
                key = key_of(folder, solver)
            answer = self._recall(key, decks, folder)
            if answer is not None:
                result = typed(answer, None)
            else:
                limit_s = decks.design.solver.time_limit_s * max(1, len(decks.loads_N))
                limit_s *= MODES_ON_TOP if decks.loaded_modes else 1
                answer = self._run(folder, limit_s)
                self._refuse_wrong(answer, decks, folder)
                words = answer.get("failure", "")
                kept = self._kept(folder, words) if words else None
                result = typed(answer, kept)
                if not words or answer.get("cause", SETTLED[0]) in SETTLED:
                    self._record(key, {}, {"answer": answer})
        except solver.refusals as error:
            folders.drop(folder)
            raise DeckRefused(decks.design.explained(str(error))) from None
        except solver.failures as error:
            cause = getattr(error, "cause", "crashed")
            failure = EvaluationFailed(cause, str(error), self._kept(folder, str(error)))
            if cause in SETTLED:
                name = failure.folder.name if failure.folder else None
                content = {"cause": cause, "words": failure.words, "folder": name}
                self._record(key, {"cause": cause}, content)
            raise failure from None
        except EvaluationFailed as failure:
            if failure.folder and failure.folder.exists():
                folders.drop(folder)
                raise
            words = failure.words
            raise EvaluationFailed(failure.cause, words, self._kept(folder, words)) from None
        except OSError as error:
            folders.drop(folder)
            place = error.filename or str(folder)
            raise NotWritten(error.errno, error.strerror or str(error), place) from None
        except BaseException:
            folders.drop(folder)
            raise
        if self.keep and not kept:
            folders.keep(folder, "finished")
        elif not kept:
            folders.drop(folder)
        return result

    def evaluate_all(
        self, questions: Iterable[Question], jobs: int = 1
    ) -> Iterator[Evaluation | EvaluationFailed]:
        """Answers in the order of the questions, failures among them; ``jobs`` at a time."""
        return _not_refused(self.answer_all(questions, jobs))

    def answer_all(
        self, questions: Iterable[Question], jobs: int = 1
    ) -> Iterator[Evaluation | EvaluationFailed | DeckRefused]:
        """`evaluate_all` with refusals among the answers, instead of raised."""
        return self._each("evaluate", [(question,) for question in questions], jobs)

    def press_all(
        self, questions: Iterable[PressQuestion], jobs: int = 1
    ) -> Iterator[Pressed | EvaluationFailed]:
        """`press` for each question, in their order; ``jobs`` at a time."""
        return _not_refused(self._each("press", list(questions), jobs))

    def _each(self, ask: str, questions: Sequence[Any], jobs: int) -> Iterator[Any]:
        """Answers to questions in order, by ``jobs`` workers or the scheduler; ``ask`` is evaluate
        or press."""
        self.on_progress(0, len(questions))
        if len(questions) <= 1 or (jobs <= 1 and not self.scheduler):
            for done, arguments in enumerate(questions, start=1):
                answer = _answer(self, ask, arguments)
                self.on_progress(done, len(questions))
                yield answer
            return
        if ask == "evaluate" and (nominal := self.design.nominal):
            self._inflated(nominal)  # before the workers each ask for it
        first = self._press_bases(questions) if ask == "press" else {}
        done = len(first)
        if first:
            self.on_progress(done, len(questions))
        others = [arguments for place, arguments in enumerate(questions) if place not in first]
        with executor(jobs, self.scheduler) as workers:
            work = partial(_answer_and_count, self.worker(), ask)
            answers = in_order(workers.each(work, others))
            for place in range(len(questions)):
                if place in first:
                    yield first[place]
                    continue
                answer, done = next(answers), done + 1
                self.on_progress(done, len(questions))
                if isinstance(answer, EvaluationFailed):  # its process died
                    yield answer
                    continue
                result, counts = answer
                self.counts.add(counts)
                if isinstance(result, Pressed) and questions[place].base:
                    question = questions[place]
                    loads, gradients = tuple(question.loads_N), tuple(question.gradients)
                    self._remember((_key(self._with(question.values)), loads, gradients), result)
                yield result
            next(answers, None)  # to their end: workers of a loop that is cut off are ended

    def _press_bases(self, questions: Sequence[PressQuestion]) -> dict[int, Any]:
        """Press the designs from which others begin, in this process, before the workers each do.
        Returns the answers of those that are asked for themselves, by their places."""
        own = [place for place, each in enumerate(questions) if each.values == each.base]
        answers = {place: _answer(self, "press", questions[place]) for place in own}
        for each in questions:
            if each.base:
                self._pressed(each.base, tuple(each.loads_N), each.gradients)
        return answers

    def worker(self) -> Evaluator:
        """A copy for another process, wherever it is, with counts of its own."""
        folder = self.folder.absolute() if self.folder else None
        return Evaluator(
            self.design,
            self.solver_name,
            folder,
            self.keep,
            self.store,
            command=tuple(getattr(self.solver, "command", self.command)),
            shapes=self.shapes,
            pressed_tyres=self.pressed_tyres,
        )

    def of(self, design: Design) -> Evaluator:
        """A copy for another tyre's designs, with the same counts and listener."""
        other = self.worker()
        other.design, other.counts, other.on_progress = design, self.counts, self.on_progress
        return other

    def _refuse_wrong(self, answer: Any, decks: Decks, folder: Path) -> None:
        """Raises EvaluationFailed for a solver's answer that is none to ``decks``."""
        whole = answer
        if isinstance(answer, dict):  # one that ended early at a load for any cause is believed
            whole = {key: value for key, value in answer.items() if key != "cause"}
        try:
            check({"answer": whole})
            wrong = contradiction(answer, decks, folder)
        except Damaged as error:
            wrong = str(error)
        if wrong:
            words = f"the result of solver '{self.solver.name}' is not used: {wrong}"
            raise EvaluationFailed("no_results", words)

    def _recall(self, key: str, decks: Decks, folder: Path) -> SolverAnswer | None:
        """The stored answer of a question; None if there is none. Raises EvaluationFailed if it is
        a failure."""
        content = self.store.read(key) if self.store else None
        if not self.store or content is None:
            return None
        if "answer" in content:
            answer: SolverAnswer = content["answer"]
            if wrong := contradiction(answer, decks, folder):
                self.store.set_aside(self.store.path(key), wrong)
                return None
            self.counts.recorded += 1
            return answer
        self.counts.recorded += 1
        raise EvaluationFailed(
            content["cause"], printable(content["words"]), self._known(content["folder"])
        )

    def _known(self, folder: str | None) -> Path | None:
        """The folder of that name (older records: path), where it is a run of ours that failed."""
        if not folder or self.folder is None or "\0" in folder:
            return None
        path, parent = self.folder / Path(folder).name, self.folder.resolve()
        return (
            path if path.resolve().parent == parent and (path / folders.OUTCOME).is_file() else None
        )

    def _run(self, folder: Path, time_limit_s: float) -> SolverAnswer:
        refuse_missing_program(self.solver)
        self.counts.runs += 1
        self.solver.run(folder, time_limit_s)
        return self.solver.read(folder)

    def _record(self, key: str, about: dict[str, str], content: Json) -> None:
        if self.store and key:
            names = {"solver": self.solver.name, "version": self.solver.version}
            self.store.write(key, {**names, **about}, content)

    def _kept(self, folder: Path, outcome: str) -> Path | None:
        """The folder of a failure; None where it is among temporary ones, and dropped."""
        if self.folder is None and not self.keep:
            folders.drop(folder)
            return None
        return folders.keep(folder, outcome)


def _key(design: Design) -> DesignKey:
    """Key that distinguishes nominal designs."""
    return design.header, design.pressure_kPa, tuple(sorted(design.values.items()))


def _advised(failure: EvaluationFailed, design: Design) -> EvaluationFailed:
    """The failure of a tyre that finds no stable equilibrium, with what may help."""
    is_buckling = any(words in failure.words for words in ("no equilibrium", "buckle"))
    if not is_buckling or not design.advice_on_buckling:
        return failure
    words = f"{failure.words}; {design.advice_on_buckling}"
    return EvaluationFailed(failure.cause, words, failure.folder)


def _shape(result: Evaluation) -> Array:
    """Node numbers and displacements (n, 4) of an inflated tyre; empty where they are not known."""
    if len(result.nodes) != len(result.displacement):
        return np.empty((0, 4))
    return np.column_stack([result.nodes, result.displacement])


def _answer(evaluator: Evaluator, ask: str, arguments: tuple[Any, ...]) -> Any:
    """Result of the evaluator's method ``ask``, or the failure or refusal that it raises."""
    try:
        return getattr(evaluator, ask)(*arguments)
    except (EvaluationFailed, DeckRefused) as failure:
        return failure


def _not_refused(answers: Iterator[Any]) -> Iterator[Any]:
    """The answers; raises a refusal among them."""
    for answer in answers:
        if isinstance(answer, DeckRefused):
            raise answer
        yield answer


def _answer_and_count(
    evaluator: Evaluator, ask: str, arguments: tuple[Any, ...]
) -> tuple[Any, Counts]:
    return _answer(evaluator, ask, arguments), evaluator.counts
