"""Coupling of near modes by turned cords, by one step of each source of error that turns them.

A step is one standard deviation. `coupling` gives q and a rise of each source: size^2 is the sum of
q^2, and the rise of a `Coupling` the mean of these rises, weighted by q^2. The symbols are those of
`veering`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from math import log
from typing import Protocol

import numpy as np

from ...simulate.modes.find import LabelledModes, ModesAnswer
from ...simulate.modes.label import Label
from ...tyre.number_units import unit_of
from .between import Between
from .model import Coupling, ModelRow, state_of
from .model_designs import ModelDesigns
from .uncertainties import Source

Array = np.ndarray
# distance in ln f, at some pressure, below which modes of one harmonic may veer
MAY_VEER = 0.15


class Coupled(Protocol):
    """A tyre that can give its modes at other designs."""

    rows: list[ModelRow]
    found: list[Source]
    between: Between
    designs: ModelDesigns

    def modes(
        self, wanted: Sequence[tuple[dict[str, float], tuple[str, ...]]]
    ) -> list[ModesAnswer]:
        """Labelled modes of designs, each with the names of which sensitivities are wanted."""


def partner(label: Label | None) -> Label | None:
    """The mode of the other family that one of the same harmonic can be coupled with."""
    if label is None or label.m > 1 or (label.c == 0) != (label.kind is not None):
        return None
    if label.kind:
        return Label(0, 0, "torsional" if label.kind == "axial" else "axial")
    return Label(label.c, 1 - label.m)


def coupling(at_0: Array, slopes: Array, above: Array) -> tuple[Array, Array]:
    """|q| and the rise of (a + b)/2, both over lambda, by one standard deviation of a constant.

    at_0: ln f (2, pressures) of a pair at x0; slopes: its derivatives by the constant in standard
    deviations; above: ln f with the constant one standard deviation higher.
    D^2 = delta^2 + q^2 = (delta_0 + p z)^2 + (q z)^2 with the constant z standard deviations higher
    and p = d delta / dz, whichever mode has which label.
    """
    scale = at_0.mean(0)
    here, there = (np.exp(2 * (ln_f - scale)) for ln_f in (at_0, above))
    rates = 2 * here * slopes
    delta, rate = (here[0] - here[1]) / 2, (rates[0] - rates[1]) / 2
    up = ((there[0] - there[1]) / 2) ** 2
    both = np.maximum(up - delta**2 - 2 * delta * rate, 0.0)
    size = np.sqrt(np.maximum(both - np.minimum(rate**2, both), 0.0))
    return size, there.mean(0) - here.mean(0) - rates.mean(0)


def cord_coupling(model: Coupled, x: Array, eta: Array, constants: Array) -> Coupling | None:
    """Coupling by turned cords of modes that are near each other at x; other constants move
    modes, and couple hardly any. None where there are no such modes.

    One step of each, to the other side where that has no solution, at the lowest and the
    highest pressure; between them q^2 is linear in ln p (`Between.straight`). eta (r,), constants
    (r, k): of the r rows of `Between`, of which the first n are the model's.
    """
    rows, count = model.between.rows, len(model.rows)
    places = {(label, state_of(w) if label else w): i for i, (label, w) in enumerate(rows)}
    # rows of the modes of the other family with the same number of waves (`partner`)
    mates = np.array(
        [places.get((partner(label), state_of(w)), -1) if label else -1 for label, w in rows]
    )
    near = {
        label
        for i, (label, _) in enumerate(rows)
        if mates[i] >= 0 and abs(eta[i] - eta[mates[i]]) < MAY_VEER
    }
    mates[[label not in near for label, _ in rows]] = -1
    turned = {
        k: source
        for k, source in enumerate(model.found)
        if any(unit_of(path) == "degrees" for path in source.steps)
    }
    if not near or not turned:
        return None
    own, ends = {**model.designs.constants, **model.designs.values(x)}, model.between.ends

    def moved(source: Source, side: float) -> list[tuple[dict[str, float], tuple[str, ...]]]:
        steps = {k: own[k] + side * step for k, step in source.steps.items() if k in own}
        return [model.designs.in_state(state, {**own, **steps}) for state in ends]

    answers = iter(model.modes([each for s in turned.values() for each in moved(s, 1.0)]))
    square, rise = np.zeros(len(rows)), np.zeros(len(rows))
    for k, source in turned.items():
        side, here = 1.0, list(islice(answers, len(ends)))
        if not all(isinstance(answer, LabelledModes) for answer in here):
            side, here = -1.0, model.modes(moved(source, -1.0))
        ln_f = eta.copy()
        for state, answer in zip(ends, here, strict=True):
            if not isinstance(answer, LabelledModes):
                raise answer
            for i, (label, where) in enumerate(rows):
                if label and mates[i] >= 0 and state_of(where) == state:
                    ln_f[i] = log(answer.wanted[label].frequency_Hz)
        slope = side * constants[:, k]
        q, more = coupling(*(np.array([v, v[mates]]) for v in (eta, slope, ln_f)))
        square, rise = square + q**2, rise + q**2 * more
    square, rise = (model.between.straight(each) for each in (square, rise))
    size = np.where(mates >= 0, np.sqrt(square), 0.0)[:count]
    rise = np.where(size > 0, rise[:count] / np.maximum(square[:count], 1e-300), 0.0)
    return Coupling(np.where(mates < count, mates, -1)[:count], size, rise)
