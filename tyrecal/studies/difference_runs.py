"""How many runs sensitivities by differences take, and how long, printed before they begin.

Commands print it where the solver gives no exact sensitivities.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from time import monotonic

from ..simulate.evaluate.evaluator import Evaluator, Question
from .run_plan import time_in_words


def runs_in_words(
    evaluator: Evaluator, values: Mapping[str, float], runs: int, jobs: int = 1
) -> str:
    """A sentence on about so many ``runs``, ``jobs`` at a time; "" for exact sensitivities. The
    design ``values`` is run to measure the time, again if it is recorded. Raises what
    ``Evaluator.evaluate`` does."""
    if evaluator.has_gradients:
        return ""
    before = evaluator.counts.runs
    for each in (evaluator, replace(evaluator, store=None)):
        began = monotonic()
        each.evaluate(Question(values))
        seconds = monotonic() - began
        if evaluator.counts.runs > before:
            break
    return (
        f"sensitivities are differences: about {runs} runs of solver '{evaluator.solver.name}',"
        f" {time_in_words(seconds)} each: about {time_in_words(runs * seconds / jobs)} with {jobs}"
        " at a time, less where runs are recorded"
    )
