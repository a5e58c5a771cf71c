"""Decks of a tyre in a dialect, and where its variables stand in them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import takewhile
from math import ceil
from typing import Any

from ..case import LoadedCase, number_at, with_values
from ..effects import catalogue, with_effects
from .apart import Apart
from .beside import beside_the_deck
from .calculix import calculix_context
from .context import context
from .environment import TemplateFailed, environment, render
from .header import header

ELEMENTS_A_WAVE = 7.5  # of quadratic ones: the frequencies are right to 0.4 %
NEAR_ZERO = 1e-4  # of a variable's span: below, steps are shares of this
STEP = 1e-4  # of a variable, to see which numbers of the deck it moves and how fast

OUTSIDE = re.compile(  # but for comments: an absolute path or one upwards, code of one's own
    r"^(?!\*\*).*=[ \t]*[\"']?(?:[/\\~@]|\.\.|[a-z]:[/\\]).*|^\*[ \t]*USER[ \t]*SUBROUTINE.*",
    re.MULTILINE | re.IGNORECASE,
)
Tangents = dict[str, list[tuple[str, int, int, float]]]


class Decks:
    """Texts of a case's decks, rendered when asked for.

    values: design variables already in ``case``; gradients: those whose places in the deck are
    wanted; modes_per_harmonic: the case's, or a larger number for a second look; loads_N: press
    the tyre on the road with these instead of finding modes; loaded_modes: how many to find there.
    """

    def __init__(
        self,
        case: LoadedCase,
        values: Mapping[str, float] | None = None,
        gradients: tuple[str, ...] = (),
        modes_per_harmonic: int | None = None,
        loads_N: tuple[float, ...] = (),
        loaded_modes: int = 0,
    ):
        self.case, self.values, self.gradients = case, dict(values or {}), gradients
        self.loads_N, self.loaded_modes = loads_N, loaded_modes
        self.header = header(case)  # of all its texts: slopes come of their data
        analysis = case.case.analysis
        self.request: dict[str, Any] = {
            "highest_harmonic": analysis.highest_harmonic,
            "modes_per_harmonic": modes_per_harmonic or analysis.modes_per_harmonic,
            "loads_N": loads_N,
            "loaded_modes": loaded_modes,
            **beside_the_deck(case),
        }

    def texts(self, dialect: str) -> dict[str, str]:
        """File name to text, which begins with `header`. Raises TemplateFailed."""
        return self._texts(self.case, dialect)

    def _texts(self, case: LoadedCase, dialect: str) -> dict[str, str]:
        own = case.case.templates
        env = Apart(dialect, case.folder / own) if own else environment(dialect, None)
        texts = DIALECTS[dialect](with_effects(case), env, self.request)
        if own:
            for file, text in texts.items():
                _refuse_outside(file, text)
        return {file: self.header + text for file, text in texts.items()}

    def tangents(self, dialect: str) -> Tangents:
        """Per variable, rows [job, 1-based line, 0-based field, d number / d variable].

        From two decks written a little to either side of the variable, so it holds for any
        template; the derivative is exact where the deck's number is linear in the variable.
        Raises TemplateFailed where keywords come and go with the variable.
        """
        result: Tangents = {}
        for name in self.gradients:
            above, below = self._beside(name, 1), self._beside(name, -1)
            texts = [self._texts(case, dialect) for case, _ in (above, below)]
            if self.values[name] == 0:  # an effect: its keywords may be there on one side only
                own = self.texts(dialect)
                if any(
                    t.keys() != own.keys() or _keywords(t[file]) != _keywords(own[file])
                    for t in texts
                    for file in own
                ):
                    raise TemplateFailed(
                        f"{name} is 0, where keywords of the deck come and go: it has no slope"
                        " there, give it another value"
                    )
            result[name] = [
                (file.removesuffix(".inp"), *row)
                for file in texts[0]
                for row in _slopes(file, texts[0][file], texts[1][file], above[1] - below[1])
            ]
        return result

    def _beside(self, name: str, side: int) -> tuple[LoadedCase, float]:
        """The case a small step to one side of a variable, or at it where that side is none.

        The step is a share of the value or, where that is next to nothing beside the variable's
        span, of the span, as the deck's digits would not show it else; it leads to no other sign.
        """
        value = self.values[name]
        variable = self.case.case.variables.get(name)
        span, least = 1.0, 0.0
        if variable:
            span = max(abs(variable.lower), abs(variable.upper))
            least = 0.0 if variable.scale == "log" else NEAR_ZERO * span
        elif name.startswith("effects."):
            effect = catalogue()[name.removeprefix("effects.")]
            span = max(abs(effect.low), abs(effect.high))
            least = NEAR_ZERO * span
        moved = value + side * STEP * (max(abs(value), least) if value else span)
        if moved * value < 0:
            moved = value
        try:
            return with_values(self.case, {name: moved}), moved
        except ValueError:
            return with_values(self.case, {name: value}), value


def _abaqus(case: LoadedCase, env: Any, request: Mapping[str, Any]) -> dict[str, str]:
    names = context(case)
    names["mesh_block"] = _mesh_block(env, names["mesh"])
    names["modes"] = 2 * request["modes_per_harmonic"] * (request["highest_harmonic"] + 1)
    names["loads"], names["loaded_modes"] = request["loads_N"], request["loaded_modes"]
    if names["loaded_modes"]:
        half = fine_enough(case.case.road.element_angles_deg, request["highest_harmonic"])
        names["road"]["angles"] = half + half[::-1]
    jobs = ("inflate", "press" if names["loads"] else "modes")
    texts = {f"{job}.inp": render(env, f"{job}.inp.j2", names) for job in jobs}
    if case.case.splice.share:
        if names["loads"]:
            raise TemplateFailed("splice: a tyre with a splice cannot be pressed on a road")
        names = context(_spliced(case))
        names["mesh_block"] = _mesh_block(env, names["mesh"])
        texts["splice.inp"] = render(env, "inflate.inp.j2", names)
    return texts


def _spliced(case: LoadedCase) -> LoadedCase:
    """The case as it is in its splice. Raises TemplateFailed."""
    splice = case.case.splice
    try:
        values = {path: number_at(case, path) * (1 + splice.share) for path in splice.numbers}
        return with_values(case, values)
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


def _calculix(case: LoadedCase, env: Any, request: Mapping[str, Any]) -> dict[str, str]:
    """The sector, its inflation, and a deck per nodal diameter that goes on from there."""
    if case.case.analysis.sectors < 4 * request["highest_harmonic"]:
        raise TemplateFailed(
            f"analysis.sectors is {case.case.analysis.sectors}, must be at least 4 times"
            " highest_harmonic for CalculiX"
        )
    names = calculix_context(case)
    names["modes"] = 2 * request["modes_per_harmonic"]  # they come in pairs, n = 0 too
    texts = {f"{job}.inp": render(env, f"{job}.inp.j2", names) for job in ("sector", "inflate")}
    for n in range(request["highest_harmonic"] + 1):
        texts[f"modes_{n}.inp"] = render(env, "diameter.inp.j2", {**names, "diameter": n})
    return texts


DIALECTS = {"abaqus": _abaqus, "calculix": _calculix}


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


def _refuse_outside(file: str, text: str) -> None:
    """Raises TemplateFailed where a deck of somebody's own templates would have the solver read or
    write elsewhere than in its run folder, compile a program or load a library."""
    for found in OUTSIDE.finditer(text):
        line = text.count("\n", 0, found.start()) + 1
        raise TemplateFailed(
            f"{file}, line {line}: '{found[0].strip():.60}' leads out of the run's folder"
        )


def _keywords(text: str) -> tuple[int, list[str]]:
    """The deck's number of lines, and its keyword lines."""
    return text.count("\n"), re.findall(r"^\*\w.*", text, re.MULTILINE)


def _slopes(file: str, above: str, below: str, width: float) -> list[tuple[int, int, float]]:
    """Fields that differ between two decks: (line, field, difference over ``width``).

    Comments and headings may differ as they like. Raises TemplateFailed.
    """
    if above == below:
        return []
    first, second = above.splitlines(), below.splitlines()
    if len(first) != len(second):
        raise TemplateFailed(f"{file}: its number of lines depends on a variable: no derivative")
    rows, keyword = [], ""
    for line, (one, other) in enumerate(zip(first, second, strict=True), start=1):
        if one.startswith("*") and not one.startswith("**"):
            keyword = one.split(",")[0].upper()
        if one == other or one.startswith("**") or keyword == "*HEADING":
            continue
        try:
            if one.startswith("*"):
                raise ValueError("a keyword line")
            fields = zip(one.split(","), other.split(","), strict=True)
            rows += [
                (line, i, (float(a) - float(b)) / width)
                for i, (a, b) in enumerate(fields)
                if a != b
            ]
        except ValueError:
            raise TemplateFailed(
                f"{file}, line {line}: '{one.strip()}' changes with a variable, but not as numbers"
                " of a data line: it has no exact derivative"
            ) from None
    return rows
