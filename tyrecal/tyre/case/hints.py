"""Hints on cases: compounds whose losses in a vibration are not known, or not those of their Prony
series; and thin cords that bear compression, which may buckle in the model.

A Prony series fitted to relaxation ends far below the modes of a tyre. Beyond its last term its
modulus is constant, and its loss factor falls as 1 / f, to a tenth or less of a compound's. No
damping ratio counts the loss of a series.

`validate` prints the hint on cords for a case that states loads on a road, and the failure of a
tyre without a stable equilibrium ends with it. The shipped cases state no loads: their cords bear
compression as in the papers they are from.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np

from .loaded import LoadedCase
from .parts import Cord, Rubber

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


# Young's modulus below which a cord counts as textile: nylon and polyester have 3 to 10, steel 190
TEXTILE_PA = 30e9
MERIDIONAL_DEG = 45.0  # angles below it, from the meridian: a carcass, not wires around a bead


def slack_cord_hint(case: LoadedCase) -> str:
    """One sentence that ends with the line that lets textile and carcass cords go slack; empty if
    none of them bears compression, or the case has no layers."""
    layers = case.case.rebar_layers
    stiff = {
        name: material
        for name, material in case.case.materials.items()
        if isinstance(material, Cord) and material.bears_compression
    }
    carcass = {name for name in layers if reaches_the_bead(case, name)}
    slack, lines, copied = [], [], []
    for material, cord in stiff.items():
        users = [name for name, layer in layers.items() if layer.material == material]
        if cord.youngs_modulus_Pa < TEXTILE_PA:
            thin, name = users, material  # layers to go slack, and the material to give them
        else:
            thin = [user for user in users if user in carcass]
            name = material if thin == users else f"{material}_of_carcass"
        if not thin:
            continue
        if name != material:
            copied.append(f"copy materials.{material} as {name} for these layers, with ")
        slack += thin
        lines.append(f"materials.{name}.bears_compression: false")
    if not slack:
        return ""
    return (
        f"cords of {', '.join(slack)} bear compression and may buckle; let them go slack:"
        f" {''.join(copied)}{', '.join(lines)}"
    )


def reaches_the_bead(case: LoadedCase, layer: str) -> bool:
    """Whether cords of a layer run into the bead along the meridian, as a carcass and its turn-up
    do."""
    own, section = case.case.rebar_layers[layer], case.section
    last = section.regions[-1][0]  # name of the region at the bead
    # r, m, at the last station, the bead; NaN: the line ends before
    there = section.points[section.names.index(own.line), -1, 0]
    ends_there = own.regions is None or last in own.regions
    return bool(ends_there and not np.isnan(there) and abs(own.angle_deg) < MERIDIONAL_DEG)
