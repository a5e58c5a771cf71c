"""Frequencies at pressures between the lowest and the highest one.

What an effect, or a small step of a design variable, adds to ln f changes smoothly with the
pressure. So the tyre with it is evaluated at both ends only, and between them the shift from the
plain tyre is a cubic in ln p with the exact sensitivities by the pressure at both ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...tyre.state import TyreState
from .model import Answer, ModelRow, state_of

Array = np.ndarray


@dataclass(frozen=True)
class Between:
    """Rows of a model, and more behind them so that each mode has one at both ends."""

    rows: tuple[ModelRow, ...]  # n of them
    ends: tuple[TyreState, ...]  # states at the lowest and the highest pressure of each rim
    low: Array  # (n,) row of the same mode at the lowest pressure
    high: Array  # (n,) and at the highest
    ln_p: Array  # (n,)

    @classmethod
    def of(cls, rows: Sequence[ModelRow], states: Sequence[TyreState]) -> Between:
        """The ends of ``states``, which rise by pressure, for each rim."""
        by_rim: dict[TyreState, list[TyreState]] = {}
        for state in states:
            by_rim.setdefault(replace(state, pressure_kPa=None), []).append(state)
        ends = {state: (own[0], own[-1]) for own in by_rim.values() for state in own}
        modes = [(label, ends[state_of(where)]) for label, where in rows if label]
        places = {
            (label, state_of(where) if label else where): i for i, (label, where) in enumerate(rows)
        }
        every = list(rows)
        for label, both in modes:
            for state in both:
                if (label, state) not in places:
                    places[label, state] = len(every)
                    every.append((label, state))
        low, high = (
            [
                places[label, ends[state_of(where)][side]] if label else i
                for i, (label, where) in enumerate(every)
            ]
            for side in (0, 1)
        )
        ln_p = [
            np.log(state_of(where).pressure_kPa or 1.0) if label else 0.0 for label, where in every
        ]
        at_ends = dict.fromkeys(end for both in ends.values() for end in both)
        return cls(tuple(every), tuple(at_ends), np.array(low), np.array(high), np.array(ln_p))

    @property
    def inner(self) -> Array:
        """Rows (n,) between the ends."""
        place = np.arange(len(self.rows))
        return (place != self.low) & (place != self.high)

    def straight(self, values: Array) -> Array:
        """Values (n, ...), of which those between the ends are replaced: linear in ln p."""
        width = self.ln_p[self.high] - self.ln_p[self.low]
        share = (self.ln_p - self.ln_p[self.low]) / np.where(self.inner, width, 1.0)
        share = share.reshape(-1, *[1] * (values.ndim - 1))
        line = values[self.low] * (1 - share) + values[self.high] * share
        return np.where(self.inner.reshape(share.shape), line, values)

    def filled(self, answer: Answer, plain: Answer) -> Answer:
        """The answer, which holds at the ends only, with its rows between them."""
        shift = self.straight(answer.eta - plain.eta)
        if answer.by_pressure is not None and plain.by_pressure is not None:
            rate, chord = answer.by_pressure - plain.by_pressure, answer.eta - plain.eta
            width = self.ln_p[self.high] - self.ln_p[self.low]
            t = (self.ln_p - self.ln_p[self.low]) / np.where(self.inner, width, 1.0)
            rise = chord[self.high] - chord[self.low]
            # Hermite's cubic less its chord is t (1 - t) bent
            bent = (rate[self.low] * width - rise) * (1 - t) - (rate[self.high] * width - rise) * t
            shift = shift + np.where(self.inner, t * (1 - t) * bent, 0.0)
        return replace(
            answer,
            eta=plain.eta + shift,
            jacobian=plain.jacobian + self.straight(answer.jacobian - plain.jacobian),
            split=self.straight(answer.split),
            damping=None
            if answer.damping is None or plain.damping is None
            else plain.damping + self.straight(answer.damping - plain.damping),
            slopes={id: self.straight(slope) for id, slope in answer.slopes.items()},
        )
