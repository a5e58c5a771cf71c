"""The order of measurements: greedy, by what an hour adds to the chance of finding an effect.

The chance is the share of drawn tyres, equally many with each effect, whose effect is found. A step
is one item of the menu, or two where they gain more together than each alone: then the better of
the two comes first. The first step is a set of response functions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from .chance import NONE, Drawn
from .laboratory import Laboratory

MIN_CHANCE_GAIN = 0.01  # of the chance, below which a step is not worth its hours
PAIRED = 4  # items that are tried in pairs


def order(lab: Laboratory, drawn: Drawn, hours: float = np.inf) -> list[str]:
    """Names of the items in their order, within ``hours``."""
    drawn = drawn.only(np.array(drawn.keys) != NONE)
    known: dict[frozenset[str], float] = {frozenset(): 0.0}

    def chance(done: Sequence[str]) -> float:
        key = frozenset(done)
        if key not in known:
            known[key] = float(lab.linear.found(drawn, lab.rows(sorted(done))).mean())
        return known[key]

    done: list[str] = []
    while step := _next(lab, chance, done, hours):
        done.append(step)
    return done


def _next(
    lab: Laboratory, chance: Callable[[Sequence[str]], float], done: Sequence[str], hours: float
) -> str:
    """The next item, "" if none is worth its hours."""
    fits = lambda *more: lab.hours([*done, *more]) <= hours
    left = [name for name in lab.offered(done) if fits(name)]
    if not done:  # a set of response functions, which alone has a pressure
        left = [name for name in left if lab.menu[name].pressure_kPa is not None]
    gain = lambda *more: chance([*done, *more]) - chance(done)
    steps: dict[tuple[str, ...], float] = {(name,): gain(name) for name in left}
    rate = lambda step: steps[step] / lab.hours(step)
    best = sorted(left, key=lambda name: -rate((name,)))
    for pair in combinations(best[:PAIRED], 2):
        if pair[1] in lab.offered([*done, pair[0]]) and fits(*pair):
            steps[pair] = gain(*pair)
    worth = [step for step in steps if steps[step] >= MIN_CHANCE_GAIN or not done]
    return max(worth, key=rate)[0] if worth else ""  # of a pair the better one: ``best`` falls
