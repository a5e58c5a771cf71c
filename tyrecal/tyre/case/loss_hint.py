"""Hints on compounds whose losses in a vibration are not known, or not those of their Prony series.

A Prony series fitted to relaxation ends far below the modes of a tyre. Beyond its last term its
modulus is constant, and its loss factor falls as 1 / f, to a tenth or less of a compound's. No
damping ratio counts the loss of a series.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

from .loaded import LoadedCase
from .parts import Rubber

# a series describes rubber up to so many times 1 / (2 pi tau), and down to 1/10: a term's loss
# modulus g x / (1 + x^2), x = 2 pi f tau, is a fifth of its peak there
PRONY_REACH = 10.0


def lossless_hint(case: LoadedCase) -> Iterator[str]:
    """A sentence on compounds without a loss factor, where others have one."""
    by_loss: dict[bool, list[str]] = {True: [], False: []}
    for name, each in case.case.materials.items():
        if isinstance(each, Rubber):
            by_loss[bool(each.loss_factor)].append(f"materials.{name}")
    if by_loss[True] and by_loss[False]:
        yield (
            f"{', '.join(by_loss[False])}: without loss_factor, so without loss in every damping"
            " ratio; a Prony series adds none"
        )


def prony_hints(case: LoadedCase) -> Iterator[str]:
    """A sentence on each Prony series that the case uses beyond its terms."""
    hertz = case.case.analysis.vibration_frequency_Hz
    for name, each in case.case.materials.items():
        if hertz is None or not isinstance(each, Rubber) or not each.prony:
            continue
        own = sorted(1 / (2 * pi * term.tau_s) for term in each.prony)
        if not own[0] / PRONY_REACH <= hertz <= own[-1] * PRONY_REACH:
            span = " to ".join(dict.fromkeys(f"{f:.2g}" for f in (own[0], own[-1])))
            yield (
                f"materials.{name}.prony has terms of {span} Hz (1/(2 pi tau_s)), and"
                f" analysis.vibration_frequency_Hz is {hertz:g}: there its modulus is constant, and"
                " its loss no measure of damping; state loss_factor"
            )
