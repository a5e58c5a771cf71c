"""The one door for evaluations: a design goes in, modes or a typed failure come out."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from ..case import LoadedCase, with_values
from ..deck.write import Decks
from .failure import DeckRefused, EvaluationFailed
from .results import Evaluation, HarmonicShape, RawMode
from .solver import Solver, find_solver

CAUSES = {
    "InflationFailed": "no_equilibrium",
    "Unstable": "unstable",
    "TimedOut": "timed_out",
}


@dataclass(frozen=True)
class Question:
    """One evaluation: values of variables or of any number of the case, by name or path.

    gradients: names of variables whose slopes are wanted; modes_per_harmonic: None = the case's.
    """

    values: Mapping[str, float]
    gradients: tuple[str, ...] = ()
    modes_per_harmonic: int | None = None


@dataclass
class Door:
    """Evaluates designs of a case with a solver, each in a fresh folder under ``folder``.

    keep: leave the folders of successful runs too (those of failures are always kept).
    """

    case: LoadedCase
    solver_name: str = ""
    folder: Path | None = None
    keep: bool = False
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
        """Modes of one design.

        Raises EvaluationFailed; DeckRefused, TemplateFailed, CaseError where the input is wrong.
        """
        try:
            case = with_values(self.case, question.values)
        except ValueError as error:
            raise DeckRefused(str(error)) from None
        decks = Decks(case, question.values, question.gradients, question.modes_per_harmonic)
        folder = self._fresh_folder()
        solver = self.solver
        try:
            solver.write(decks, folder)
            solver.run(folder, case.case.solver.time_limit_s)
            answer = solver.read(folder)
        except solver.refusals as error:
            self._drop(folder)
            raise DeckRefused(str(error)) from None
        except solver.failures as error:
            cause = getattr(error, "cause", None) or CAUSES.get(type(error).__name__, "crashed")
            kept = folder if self.folder is not None else None
            if kept is None:
                self._drop(folder)
            raise EvaluationFailed(cause, str(error), kept) from None
        except BaseException:
            self._drop(folder)
            raise
        if not self.keep:
            self._drop(folder)
        return _evaluation(answer)

    def evaluate_all(
        self, questions: Iterable[Question], jobs: int = 1
    ) -> Iterator[Evaluation | EvaluationFailed]:
        """Answers in the order of the questions, failures among them; ``jobs`` at a time."""
        if jobs <= 1:
            for question in questions:
                yield _answer(self, question)
            return
        worker = Door(self.case, self.solver_name, self.folder, self.keep)
        with ProcessPoolExecutor(jobs, mp_context=get_context("forkserver")) as pool:
            yield from pool.map(_answer, *zip(*((worker, q) for q in questions), strict=True))

    def _fresh_folder(self) -> Path:
        if self.folder is None:
            return Path(tempfile.mkdtemp(prefix="tyrecal-"))
        self.folder.mkdir(parents=True, exist_ok=True)
        return Path(tempfile.mkdtemp(prefix="run-", dir=self.folder))

    def _drop(self, folder: Path) -> None:
        shutil.rmtree(folder, ignore_errors=True)


def _answer(door: Door, question: Question) -> Evaluation | EvaluationFailed:
    try:
        return door.evaluate(question)
    except EvaluationFailed as failure:
        return failure


def _evaluation(answer: dict) -> Evaluation:
    modes = []
    for mode in answer["modes"]:
        frequency = mode["frequency_Hz"]
        if not (np.isfinite(frequency) and frequency > 0):
            raise EvaluationFailed("unstable", f"a mode of {frequency} Hz: the state is unstable")
        shape = HarmonicShape(mode["n"], answer["nodes"], answer["points"], mode["amplitude"])
        modes.append(RawMode(frequency, shape, mode["multiplicity"]))
    return Evaluation(
        pressure_kPa=answer["pressure_Pa"] / 1e3,
        mass_kg=answer["mass_kg"],
        modes=tuple(modes),
        gradients={name: np.array(slope) for name, slope in answer["gradients"].items()},
        nodes=answer["nodes"],
        displacement=answer["displacement"],
    )
