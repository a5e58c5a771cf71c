"""Typed failures of an evaluation. None of them ever becomes a number."""

from __future__ import annotations

from pathlib import Path

from ...errors import InputError, TyrecalError
from ...files import printable


class EvaluationFailed(TyrecalError):
    """The solver could not evaluate a design.

    cause: ``no_equilibrium``, ``unstable`` (not a minimum of energy), ``timed_out``, ``crashed``,
    ``no_results`` (missing or wrong ones), ``licence`` (none was free), ``lost_label`` (no mode
    has a wanted label) or ``refused`` (values that the case cannot have);
    words: the solver's own last words, on one line; folder: where the run is kept, or None.
    """

    exit_code = 3

    def __init__(self, cause: str, words: str, folder: Path | None = None):
        words = printable(words)  # they may be a stranger's, and go to a terminal
        super().__init__(words + (f" (run kept in {folder})" if folder else ""))
        self.cause, self.words, self.folder = cause, words, folder

    @property
    def denied(self) -> bool:
        """Whether there was no licence, which shows nothing about the design."""
        return self.cause == "licence"

    def __reduce__(self) -> tuple[type[EvaluationFailed], tuple[str, str, Path | None]]:
        return type(self), (self.cause, self.words, self.folder)


class SolverUnavailable(TyrecalError):
    """The solver, or what runs it elsewhere, cannot be had: the study ends."""

    exit_code = 3


class DeckRefused(InputError):
    """The solver refuses the deck: the case, or the user's template, needs what it lacks."""
