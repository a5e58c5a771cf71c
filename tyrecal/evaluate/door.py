"""The one door for evaluations: a design goes in, modes or a typed failure come out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..case import LoadedCase, with_values
from ..deck.write import Decks
from . import folders
from .failure import DeckRefused, EvaluationFailed
from .pool import process_pool
from .results import Evaluation, HarmonicShape, RawMode, RingShape
from .solver import Solver, find_solver
from .store import Store, key_of

CAUSES = {
    "InflationFailed": "no_equilibrium",
    "Unstable": "unstable",
    "TimedOut": "timed_out",
}
SETTLED = ("no_equilibrium", "unstable")  # the deck's own doing: another run would say the same


@dataclass(frozen=True)
class Question:
    """One evaluation: values of variables or of any number of the case, by name or path.

    gradients: names of variables whose slopes are wanted; modes_per_harmonic: None = the case's.
    """

    values: Mapping[str, float]
    gradients: tuple[str, ...] = ()
    modes_per_harmonic: int | None = None


@dataclass
class Counts:
    """How often the solver ran, and how often the record answered instead."""

    runs: int = 0
    recorded: int = 0

    def add(self, other: Counts) -> None:
        """Count what another process did."""
        self.runs, self.recorded = self.runs + other.runs, self.recorded + other.recorded


@dataclass
class Door:
    """Evaluates designs of a case with a solver, each in a fresh folder under ``folder``.

    keep: leave the folders of successful runs too (those of failures are always kept); store: the
    record that is asked before the solver, and told what it said.
    """

    case: LoadedCase
    solver_name: str = ""
    folder: Path | None = None
    keep: bool = False
    store: Store | None = None
    counts: Counts = field(default_factory=Counts)
    _solver: Solver | None = field(default=None, repr=False)

    @property
    def solver(self) -> Solver:
        """The adapter. Raises UnknownSolver."""
        if self._solver is None:
            self._solver = find_solver(self.solver_name or self.case.case.solver.name)
        return self._solver

    @property
    def has_gradients(self) -> bool:
        """Whether the solver gives exact slopes."""
        return "gradients" in self.solver.capabilities

    def evaluate(self, question: Question) -> Evaluation:
        """Modes of one design, the same from the record as from a run.

        Raises EvaluationFailed; DeckRefused, TemplateFailed, CaseError where the input is wrong;
        OSError where the run folder cannot be written.
        """
        try:
            case = with_values(self.case, question.values)
        except ValueError as error:  # no such tyre: the optimiser steps back from it
            raise EvaluationFailed("refused", str(error)) from None
        decks = Decks(case, question.values, question.gradients, question.modes_per_harmonic)
        folder = folders.fresh(self.folder)
        solver, key = self.solver, ""
        try:
            solver.write(decks, folder)
            if self.store:
                key = key_of(folder, solver)
            evaluation = self._recall(key)
            if evaluation is None:
                evaluation = self._run(folder, key, case.case.solver.time_limit_s)
        except solver.refusals as error:
            folders.drop(folder)
            raise DeckRefused(str(error)) from None
        except solver.failures as error:
            cause = getattr(error, "cause", None) or CAUSES.get(type(error).__name__, "crashed")
            failure = EvaluationFailed(cause, str(error), self._kept(folder, str(error)))
            if cause in SETTLED:
                kept = str(failure.folder.resolve()) if failure.folder else None
                content = {"cause": cause, "words": failure.words, "folder": kept}
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
            raise OSError(error.errno, error.strerror or str(error), place) from None
        except BaseException:
            folders.drop(folder)
            raise
        if self.keep:
            folders.keep(folder, f"{len(evaluation.modes)} modes")
        else:
            folders.drop(folder)
        return evaluation

    def evaluate_all(
        self, questions: Iterable[Question], jobs: int = 1
    ) -> Iterator[Evaluation | EvaluationFailed]:
        """Answers in the order of the questions, failures among them; ``jobs`` at a time."""
        if jobs <= 1:
            for question in questions:
                yield _answer(self, question)
            return
        worker = self.worker()
        with process_pool(jobs) as pool:
            tasks = zip(*((worker, q) for q in questions), strict=True)
            for answer, counts in pool.map(_answer_and_count, *tasks):
                self.counts.add(counts)
                yield answer

    def worker(self) -> Door:
        """The same door for another process, with counts of its own."""
        return Door(self.case, self.solver_name, self.folder, self.keep, self.store)

    def _recall(self, key: str) -> Evaluation | None:
        content = self.store.read(key) if self.store else None
        if content is None:
            return None
        self.counts.recorded += 1
        if "answer" in content:
            return _evaluation(content["answer"])
        kept = content["folder"]
        raise EvaluationFailed(content["cause"], content["words"], Path(kept) if kept else None)

    def _run(self, folder: Path, key: str, time_limit_s: float) -> Evaluation:
        self.counts.runs += 1
        self.solver.run(folder, time_limit_s)
        answer = self.solver.read(folder)
        evaluation = _evaluation(answer)
        self._record(key, {}, {"answer": answer})
        return evaluation

    def _record(self, key: str, about: dict[str, str], content: dict[str, Any]) -> None:
        if self.store and key:
            names = {"solver": self.solver.name, "version": self.solver.version}
            self.store.write(key, {**names, **about}, content)

    def _kept(self, folder: Path, outcome: str) -> Path | None:
        """The folder of a failure; None where it is among temporary ones, and dropped."""
        if self.folder is None and not self.keep:
            folders.drop(folder)
            return None
        return folders.keep(folder, outcome)


def _answer(door: Door, question: Question) -> Evaluation | EvaluationFailed:
    try:
        return door.evaluate(question)
    except EvaluationFailed as failure:
        return failure


def _answer_and_count(
    door: Door, question: Question
) -> tuple[Evaluation | EvaluationFailed, Counts]:
    return _answer(door, question), door.counts


def _evaluation(answer: dict[str, Any]) -> Evaluation:
    nodes, points, displacement = (  # laid out alike, so that sums are too, recorded or not
        np.ascontiguousarray(answer[name]) for name in ("nodes", "points", "displacement")
    )
    modes = []
    for mode in answer["modes"]:
        frequency = mode["frequency_Hz"]
        if not (np.isfinite(frequency) and frequency > 0):
            raise EvaluationFailed("unstable", f"a mode of {frequency} Hz: the state is unstable")
        shape: HarmonicShape | RingShape
        if "amplitude" in mode:
            amplitude = np.ascontiguousarray(mode["amplitude"])
            shape = HarmonicShape(mode["n"], nodes, points, amplitude)
        else:
            shape = RingShape(points, np.ascontiguousarray(mode["displacement"]))
        modes.append(RawMode(frequency, shape, mode["multiplicity"]))
    return Evaluation(
        pressure_kPa=answer["pressure_Pa"] / 1e3,
        mass_kg=answer["mass_kg"],
        modes=tuple(modes),
        gradients={name: np.array(slope) for name, slope in answer["gradients"].items()},
        nodes=nodes,
        displacement=displacement,
    )
