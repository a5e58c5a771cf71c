"""Error of the model by cords that bear no compression: by how much the tyre's own do is not known.

Where a layer is compressed, and up to which pressure, depends on details of the bead and of belt
edges that no section states, and it moves frequencies by some per cent. So of each such layer the
share s(p) of its compression that it bears is a source of error at each pressure p. s is uniform
from nothing, as the case has it, to all: the mean of s^2 is 1/3. Half of that is the same at all
pressures.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np

from ...tyre.case import LoadedCase
from ...tyre.case.schema import Cord
from ...tyre.effects.edit import changed, unused, with_part

Array = np.ndarray
SHARE_SD = 1 / sqrt(6)  # standard deviation of either half
COMPRESSION = "compression "  # start of the names of these sources of error


def slack_layers(case: LoadedCase) -> list[str]:
    """Rebar layers whose cords bear no compression."""
    layers, materials = case.case.rebar_layers, case.case.materials
    cords = {name: materials[layer.material] for name, layer in layers.items()}
    return [n for n, m in cords.items() if isinstance(m, Cord) and not m.bears_compression]


def with_compression(case: LoadedCase, name: str) -> LoadedCase:
    """The case where one layer's cords bear compression, the others of their material as before."""
    layer = case.case.rebar_layers[name]
    own = unused(f"{layer.material}_of_{name}", case.case.materials)
    cord = with_part(case.case.materials[layer.material], bears_compression=True)
    layers = {**case.case.rebar_layers, name: with_part(layer, material=own)}
    return changed(case, materials={**case.case.materials, own: cord}, rebar_layers=layers)


def sources_of(layer: str, pressures_kPa: Sequence[float]) -> list[str]:
    """Names of the columns of `by_share`."""
    own = f"{COMPRESSION}of {layer}"
    return [own, *(f"{own} at {p:g} kPa" for p in pressures_kPa)]


def compressed_layers(sources: Sequence[str]) -> list[str]:
    """Layers of these sources of error."""
    own = [name.removeprefix(f"{COMPRESSION}of ") for name in sources if COMPRESSION in name]
    return [name for name in own if " at " not in name]


def by_share(shift: Array, rows_kPa: Array, pressures_kPa: Sequence[float]) -> Array:
    """Changes (n, 1 + p) of ln f by one standard deviation of the share at all pressures, and at
    each of p ones; ``shift`` (n,): the change if all of the compression is borne."""
    at = rows_kPa[:, None] == np.asarray(pressures_kPa)
    return SHARE_SD * shift[:, None] * np.hstack([np.ones((len(shift), 1)), at])
