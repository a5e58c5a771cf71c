"""Decks of a tyre in a dialect, and where its variables stand in them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..case import LoadedCase, with_values
from .context import context
from .environment import TemplateFailed, environment, render

JOBS = {"abaqus": ("inflate", "modes")}
STEP = 1e-4  # of a variable, to see which numbers of the deck it moves and how fast

Tangents = dict[str, list[tuple[str, int, int, float]]]


class Decks:
    """Texts of a case's decks, rendered when asked for.

    values: design variables already in ``case``; gradients: those whose places in the deck are
    wanted; modes_per_harmonic: the case's, or a larger number for a second look.
    """

    def __init__(
        self,
        case: LoadedCase,
        values: Mapping[str, float] | None = None,
        gradients: tuple[str, ...] = (),
        modes_per_harmonic: int | None = None,
    ):
        self.case, self.values, self.gradients = case, dict(values or {}), gradients
        analysis = case.case.analysis
        self.request: dict[str, Any] = {
            "highest_harmonic": analysis.highest_harmonic,
            "modes_per_harmonic": modes_per_harmonic or analysis.modes_per_harmonic,
        }

    def texts(self, dialect: str) -> dict[str, str]:
        """File name to text. Raises TemplateFailed."""
        return _texts(self.case, dialect)

    def tangents(self, dialect: str) -> Tangents:
        """Per variable, rows [job, 1-based line, 0-based field, d number / d variable].

        From two decks written a little to either side of the variable, so it holds for any
        template; the derivative is exact where the deck's number is linear in the variable.
        """
        result: Tangents = {}
        for name in self.gradients:
            value = self.values[name]
            step = STEP * (abs(value) or 1.0)
            ends = [
                _texts(with_values(self.case, {name: value + side * step}), dialect)
                for side in (1, -1)
            ]
            result[name] = [
                (file.removesuffix(".inp"), *row)
                for file in ends[0]
                for row in _slopes(ends[0][file], ends[1][file], 2 * step)
            ]
        return result


def _texts(case: LoadedCase, dialect: str) -> dict[str, str]:
    own = case.case.templates
    env = environment(dialect, case.folder / own if own else None)
    names = context(case)
    names["mesh_block"] = _mesh_block(env, names["mesh"])
    return {f"{job}.inp": render(env, f"{job}.inp.j2", names) for job in JOBS[dialect]}


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


def _slopes(above: str, below: str, width: float) -> list[tuple[int, int, float]]:
    """Fields that differ between two decks: (line, field, difference over ``width``)."""
    if above == below:
        return []
    rows = []
    pairs = zip(above.splitlines(), below.splitlines(), strict=True)
    for line, (one, other) in enumerate(pairs, start=1):
        if one == other:
            continue
        if one.startswith("*"):
            raise TemplateFailed(
                f"a variable stands in '{one.strip()}', a keyword line: it has no exact derivative"
            )
        fields = zip(one.split(","), other.split(","), strict=True)
        for index, (a, b) in enumerate(fields):
            if a != b:
                rows.append((line, index, (float(a) - float(b)) / width))
    return rows
