"""A hint for cases whose thin cords bear compression: these may buckle in the model.

`validate` prints it for a case that states loads on a road, and the failure of a tyre without a
stable equilibrium ends with it. The shipped cases state no loads: their cords bear compression as
in the papers they are from.
"""

from __future__ import annotations

import numpy as np

from .loaded import LoadedCase
from .parts import Cord

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
