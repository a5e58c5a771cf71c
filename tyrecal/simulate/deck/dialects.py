"""Which decks a dialect has, and the names that their templates are given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import takewhile
from math import ceil
from typing import Any

from ...tyre.case import number_at
from ...tyre.resolve import Tyre
from ...tyre.templates import TemplateFailed, render
from ...tyre.values import set_values
from .abaqus import context
from .calculix import calculix_context

ELEMENTS_A_WAVE = 7.5  # of quadratic ones: the frequencies are right to 0.4 %
DeckRequest = Mapping[str, Any]  # what is asked of a deck, see `Decks.request`


def _abaqus(tyre: Tyre, env: Any, request: DeckRequest) -> dict[str, str]:
    names = context(tyre)
    names["mesh_block"] = _mesh_block(env, names["mesh"])
    names["modes"] = 2 * request["modes_per_harmonic"] * (request["highest_harmonic"] + 1)
    names["loads"], names["loaded_modes"] = request["loads_N"], request["loaded_modes"]
    if names["loaded_modes"]:
        half = fine_enough(tyre.case.road.element_angles_deg, request["highest_harmonic"])
        names["road"]["angles"] = half + half[::-1]
    jobs = ("inflate", "press" if names["loads"] else "modes")
    texts = {f"{job}.inp": render(env, f"{job}.inp.j2", names) for job in jobs}
    if tyre.case.splice.share:
        if names["loads"]:
            raise TemplateFailed("splice: a tyre with a splice cannot be pressed on a road")
        names = context(_spliced(tyre))
        names["mesh_block"] = _mesh_block(env, names["mesh"])
        texts["splice.inp"] = render(env, "inflate.inp.j2", names)
    return texts


def _spliced(tyre: Tyre) -> Tyre:
    """The tyre as it is in its splice. Raises TemplateFailed."""
    splice, case = tyre.case.splice, tyre.written
    try:
        values = {path: number_at(case, path) * (1 + splice.share) for path in splice.numbers}
        return Tyre(set_values(case, values))
    except ValueError as error:
        raise TemplateFailed(f"splice.numbers: {error}") from None


def fine_enough(angles_deg: Sequence[float], waves: int) -> list[float]:
    """Elements' lengths from the patch's middle to the top, those from the first one on that is
    too long for ``waves`` round the circumference made equal."""
    longest = 360 / (ELEMENTS_A_WAVE * max(waves, 1))
    kept = list(takewhile(lambda angle: angle <= longest, angles_deg))
    rest = 180 - sum(kept)
    more = ceil(rest / longest - 1e-9)
    return [*kept, *([rest / more] * more)]


def _calculix(tyre: Tyre, env: Any, request: DeckRequest) -> dict[str, str]:
    """The sector, its inflation, and a deck per nodal diameter that goes on from there."""
    if tyre.case.analysis.sectors < 4 * request["highest_harmonic"]:
        raise TemplateFailed(
            f"analysis.sectors is {tyre.case.analysis.sectors}, must be at least 4 times"
            " highest_harmonic for CalculiX"
        )
    names = calculix_context(tyre)
    names["modes"] = 2 * request["modes_per_harmonic"]  # they come in pairs, n = 0 too
    texts = {f"{job}.inp": render(env, f"{job}.inp.j2", names) for job in ("sector", "inflate")}
    for n in range(request["highest_harmonic"] + 1):
        texts[f"modes_{n}.inp"] = render(env, "diameter.inp.j2", {**names, "diameter": n})
    return texts


DIALECTS: dict[str, Callable[[Tyre, Any, DeckRequest], dict[str, str]]] = {
    "abaqus": _abaqus,
    "calculix": _calculix,
}
_BLOCKS: dict[tuple[int, int], tuple[Any, Any, str]] = {}


def _mesh_block(env: Any, mesh: dict[str, Any]) -> str:
    """The mesh's text, which stays the same from one evaluation of a fit to the next."""
    key = id(env), id(mesh)
    if key not in _BLOCKS or env.auto_reload:
        if len(_BLOCKS) >= 8:
            _BLOCKS.clear()
        text = render(env, "mesh.inp.j2", {"mesh": mesh}).rstrip("\n")
        _BLOCKS[key] = env, mesh, text  # holding both keeps their ids from being reused
    return _BLOCKS[key][2]
