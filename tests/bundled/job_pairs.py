"""Pairs of jobs as the tool writes them, edited, and their results."""

from __future__ import annotations

from functools import cache
from typing import Any

from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job

from ..effects.support import CASE, decks

PLAIN: tuple[tuple[str, float], ...] = ()
WHEEL, TURNING, MASS = (("wheel_free", 0.1),), (("rotation", 5.0),), (("point_mass", 0.1),)
FREQUENCY = "*FREQUENCY, EIGENSOLVER=LANCZOS, NORMALIZATION=MASS\n20\n"
STEP = "*STEP, NAME=EQUILIBRIUM"


@cache
def texts(effects: tuple[tuple[str, float], ...]) -> dict[str, str]:
    """inflate and modes."""
    written = decks(CASE, **dict(effects))
    return {name: written[f"{name}.inp"] for name in ("inflate", "modes")}


def run(effects: tuple[tuple[str, float], ...], *edits: tuple[str, str], **request: Any) -> list:
    """Results of the pair with (old, new) edits, the revolve job's where it stands in both."""
    pair = dict(texts(effects))
    for old, new in edits:
        name = "modes" if old in pair["modes"] else "inflate"
        assert old in pair[name]
        pair[name] = pair[name].replace(old, new, 1)
    return Job(Deck(pair, "modes", "inflate"), Request(**request)).run()
