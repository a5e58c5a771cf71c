"""How many runs sensitivities by differences take, and how long, printed before they begin.

Commands print it where the solver gives no exact sensitivities.
"""

from __future__ import annotations

from collections.abc import Mapping
from time import monotonic

from ..simulate.evaluate.evaluator import Evaluator, Question
from .pressing_plan import time_in_words


def runs_in_words(
    evaluator: Evaluator, values: Mapping[str, float], runs: int, jobs: int = 1
) -> str:
    """A sentence on about so many ``runs``, ``jobs`` at a time; "" for exact sensitivities. The
    design ``values`` is run to measure the time; its time is not known if it is recorded. Raises
    what ``Evaluator.evaluate`` does."""
    if evaluator.has_gradients:
        return ""
    name = evaluator.solver.name
    words = f"sensitivities are differences: about {runs} runs of solver '{name}'"
    before, began = evaluator.counts.runs, monotonic()
    evaluator.evaluate(Question(values))
    seconds = monotonic() - began
    if evaluator.counts.runs == before:
        return f"{words}, without those that are recorded"
    total = time_in_words(runs * seconds / jobs)
    return f"{words}, {time_in_words(seconds)} each: about {total} with {jobs} at a time"
