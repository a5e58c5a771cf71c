"""Exceptions of the solvers: two trees, and two states that Newton's method must avoid.

    Refused                     an option, or a request, that the solver cannot honour
        DeckError               a deck that it cannot, with its line
    RunFailed                   no results, with the cause
        NoEquilibrium           no_equilibrium: none was found at a load
    Indefinite                  a matrix that is not positive definite
    Inverted                    an element turned inside out

Each adapter names what it raises in ``refusals`` and ``failures``; the tool makes its own of them.
"""

from __future__ import annotations


class Refused(ValueError):
    """An option, a request or a deck that cannot be honoured; the message says what would be
    right."""


class RunFailed(RuntimeError):
    """A solver did not deliver.

    cause: ``crashed``, ``timed_out``, ``no_results``, ``licence``, ``unstable`` or
    ``no_equilibrium``; the message ends with the solver's own last words.
    """

    def __init__(self, cause: str, message: str, words: str = ""):
        super().__init__(f"{message}: {words}" if words else message)
        self.cause = cause


class NoEquilibrium(RunFailed):
    """No stable equilibrium was found at a load."""

    def __init__(self, message: str):
        super().__init__("no_equilibrium", message)


class Indefinite(ArithmeticError):
    """The matrix is not positive definite: the state is unstable, or has a free rigid body."""


class Inverted(ArithmeticError):
    """An element turned inside out, or nearly so; ``element``: the first, where it is known."""

    def __init__(self, element: int | None = None) -> None:
        one = f"element {element} has no positive area"
        super().__init__("elements turn inside out" if element is None else one)
        self.element = element
