"""Errors that the user reads in one sentence: one tree, an exit code in each class.

    TyrecalError
        InputError, 2               what was given is wrong: a file, a folder, a name, a number
            CaseError               a case file, with every mistake in it
            SectionError            a table of stations, with its line
            OwnDeckError            a user's deck, with file and line
            EffectRefused           an effect's parameter
            TemplateFailed          a deck template
            DeckRefused             a deck that the solver refuses
            Damaged                 a record that is not as it was written
        NotAFile                    a link, pipe or device where a file of ours should be
        NotWritten                  a file or folder that cannot be written
        EvaluationFailed, 3         one run of the solver, with its cause and folder
        SolverUnavailable, 3        no run at all can be made
        Interrupted                 a signal, with the exit code that the shell gives it

The solvers, which know nothing of the tool, have six of their own, drawn in `solvers/errors.py`:
an adapter names them, and here they become DeckRefused and EvaluationFailed. What is in neither
and comes out of a command is a fault of the tool's, and has a traceback; what the system refuses,
as a full disk, is an OSError or a MemoryError and ends with 2.
"""

from __future__ import annotations


class TyrecalError(Exception):
    """Base of all errors that the user reads in one sentence; ``exit_code``: of the command that it
    ends."""

    exit_code = 2


class InputError(TyrecalError, ValueError):
    """Input that cannot be used; the sentence says where, and what would be right.

    line: the 1-based line of a table, where the sentence does not name it; else 0.
    """

    def __init__(self, message: str = "", line: int = 0):
        super().__init__(message)
        self.line = line
