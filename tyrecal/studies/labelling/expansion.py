"""Labelings where the model is expanded about their own mean: Gauss-Newton over the likeliest one.

The tree (`tree`) takes ln f to be linear in z, with x = mean + root z (`Prior`). So the model is
expanded anew at the design that the likeliest labeling finds, until neither changes: the
probabilities are then of slopes where the measured values put the tyre, not where the case began.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.modes.label import Label, Mode
from .tree import Frequencies, Labelings, Modes, labelings

Array = np.ndarray

ROUNDS = 10  # of expansion and labelling
MAX_EXPANSION_STEP = 0.5  # of a variable's coordinate, between expansions
SAME_DESIGN = 0.01  # of its prior standard deviations
MAX_STEPS_BACK = 4  # from a design that has no solution


@dataclass(frozen=True)
class Prior:
    """Prior of the variables' coordinates x."""

    mean: Array  # (v,)
    root: Array  # (v, v) a root of the covariance, root root^T
    lower: Array  # (v,) bounds of x
    upper: Array  # (v,)


@dataclass(frozen=True)
class ModesNearDesign:
    """The model at a design: its n in-plane and out-of-plane modes; where shapes were measured, all
    others, too."""

    labels: tuple[Label, ...]
    states: Array  # (n,) number of the state of each mode
    ln_f: Array  # (n,)
    slopes: Array  # (n, v) d ln f / d x
    modes: tuple[Mode, ...] = ()  # (n,) with their shapes


@dataclass(frozen=True)
class LabelSearch:
    """Labelings of the frequencies, and the design about which the model was expanded."""

    labelings: Labelings
    expansion: ModesNearDesign
    x: Array  # (v,) coordinates of that design
    rounds: int  # number of expansions that it took
    # whether another expansion would give the same labels; if not, labelings take turns, and this
    # is the most probable one
    settled: bool

    def labels(self, place: int = 0) -> list[Label | None]:
        """Label of each measured frequency under the labeling at a place, 0: the most probable.
        None: foreign, no mode of the tyre."""
        own = self.labelings.modes[place]
        return [self.expansion.labels[j] if j >= 0 else None for j in own]


# the measured frequencies; which modes each can be depends on the modes that there are
Measured = Callable[[ModesNearDesign], Frequencies]


def find_labels(
    expand: Callable[[Array], ModesNearDesign],
    measured: Measured,
    prior: Prior,
    first: Array | None = None,
) -> LabelSearch:
    """Labelings of the measured frequencies; first: coordinates where the model is expanded first,
    by default the prior's mean. Raises what ``expand`` does there."""
    x, seen = prior.mean if first is None else first, list[LabelSearch]()
    at = expand(x)
    for round_ in range(1, ROUNDS + 1):
        slopes = at.slopes
        modes = Modes(
            at.labels, at.states, at.ln_f - slopes @ (x - prior.mean), slopes @ prior.root
        )
        answer = labelings(measured(at), modes)
        aim = np.clip(prior.mean + prior.root @ answer.z, prior.lower, prior.upper)
        step = np.clip(aim - x, -MAX_EXPANSION_STEP, MAX_EXPANSION_STEP)
        near = abs(np.linalg.lstsq(prior.root, step, None)[0]).max(initial=0.0) < SAME_DESIGN
        result = LabelSearch(answer, at, x, round_, near)
        if near and (not seen or result.labels() == seen[-1].labels()):
            return result
        seen.append(result)
        nearest = _expanded(expand, x + step, x) if round_ < ROUNDS else None
        if nearest is None:
            break
        at, x = nearest
    last = seen[len(seen) // 2 :]
    return replace(max(last, key=lambda each: each.labelings.probabilities[0]), settled=False)


def _expanded(
    expand: Callable[[Array], ModesNearDesign], x: Array, last: Array
) -> tuple[ModesNearDesign, Array] | None:
    """The model at x or, where x has no solution, nearer to the last design, and that place; None:
    there is none near that, either."""
    for _ in range(1 + MAX_STEPS_BACK):
        try:
            return expand(x), x
        except EvaluationFailed:
            x = (x + last) / 2
    return None


def admissible(labels: Sequence[Label | None], states: Array, at: ModesNearDesign) -> Array:
    """Whether each of m measured frequencies can be each of n modes, (m, n); labels: of the
    frequencies, None for unlabelled ones."""
    same = np.array([[own in (None, label) for label in at.labels] for own in labels])
    return (states[:, None] == at.states) & same
