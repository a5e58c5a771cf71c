"""Numbers of a case that no tyre has, told before they are computed with: most are slips of unit.

Only what a user states is judged, never a point that a search tries: the file's own numbers, and
those set beside it. Bounds of variables only say how far a search may go, so they are free.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import sqrt
from typing import TYPE_CHECKING, Any

from .case.checks import Problems, at, find
from .case.mistakes import Keys, dotted
from .case.parts import number
from .case.schema import MEASURED_SIGMA as SIGMAS
from .case.shape import entries, table
from .effects import catalogue
from .plugins import IDS
from .usual import (
    BELT_ANGLE,
    CARCASS_ANGLE,
    LARGEST_SIGMA,
    OF_EFFECTS,
    SMALLEST_SIGMA,
    USUAL,
    Usual,
)

if TYPE_CHECKING:
    from .section.section import Section

ALL_THE_SAME = " (--allow-unusual takes it as it is)"
_PATTERNS = [(tuple(path.split(".")), usual) for path, usual in USUAL.items()]
_OF_SIGMA = {"sigma_Hz": "frequency_Hz", **{sigma: of for of, sigma in SIGMAS.items()}}


def unusual(data: Mapping[str, Any], section: Section | None) -> Problems:
    """Every stated number of ``data`` that is outside its usual range, and what is usual."""
    for keys, value in _numbers(data, ()):
        if message := refusal(data, section, keys, value):
            yield keys, message


def refusal(
    data: Mapping[str, Any], section: Section | None, keys: Keys, value: float
) -> str | None:
    """Why ``value`` is not usual at ``keys`` of the case that ``data`` and ``section`` are of."""
    for usual, of in _ranges(data, section, keys):
        judged = value % 180 if usual is BELT_ANGLE else value
        if usual is CARCASS_ANGLE:
            judged = (value + 90) % 180 - 90
        if not usual.holds(judged) and (message := usual.refusal(value)):
            return of + message + ALL_THE_SAME
    return None


def _ranges(
    data: Mapping[str, Any], section: Section | None, keys: Keys
) -> Iterator[tuple[Usual, str]]:
    """What is usual at ``keys``, and words that go before."""
    here, last = keys[0], str(keys[-1])
    if here == "variables":
        for path in entries(at(data, keys[:-1]), "sets") if last == "start" else ():
            if isinstance(path, str) and (found := _keys(data, path)):
                yield from ((usual, f"{path}: ") for usual, _ in _ranges(data, section, found))
    elif here == "uncertainties" and last == "absolute":
        for path in entries(at(data, keys[:-1]), "sets"):
            if isinstance(path, str) and (found := _keys(data, path)):
                for usual, _ in _ranges(data, section, found):
                    value = number({"": _value(data, found)}, "")
                    most = abs(value) if value and usual.holds(value) else usual.high
                    yield Usual(0, most, usual.unit, usual.slips), f"{path}: "
    elif here == "effects" and len(keys) == 2 and last in IDS:
        effect = catalogue()[last]
        slips = OF_EFFECTS.get(effect.unit, {})
        yield Usual(effect.low, effect.high, effect.unit, slips), ""
    elif here == "rebar_layers" and last == "angle_deg":
        if section and (angle := _angle(table(table(data, here), str(keys[1])), section)):
            yield angle, ""
    elif here == "targets" and last in _OF_SIGMA:
        value = number(at(data, keys[:-1]), _OF_SIGMA[last])
        if value and value > 0:
            whole = USUAL[dotted((*keys[:2], "*", _OF_SIGMA[last]))]
            yield replace(whole, low=SMALLEST_SIGMA * value, high=LARGEST_SIGMA * value), ""
    else:
        words = tuple(map(str, keys))
        load = last == "load_N" or words[:2] == ("road", "loads_N")
        for pattern, usual in _PATTERNS:
            if len(pattern) == len(words) and all(
                p in ("*", w) for p, w in zip(pattern, words, strict=True)
            ):
                yield (_up_to_the_rim(usual, data, section) if load and section else usual), ""


def _up_to_the_rim(usual: Usual, data: Mapping[str, Any], section: Section) -> Usual:
    """A load's range, up to what flattens the tyre to its rim: a patch as wide as the tyre and as
    long as the chord there, under the inflation pressure."""
    outer = section.points[-1]
    R, width = float(outer[:, 0].max()), 2 * float(abs(outer[:, 1]).max())
    h = R - float(outer[section.rigid, 0].max())
    kPa = number(data, "pressure_kPa")
    if kPa is None or not USUAL["pressure_kPa"].holds(kPa) or not 0 < h < R:
        return usual
    most = float(f"{1e3 * kPa * width * 2 * sqrt(2 * R * h - h * h):.2g}")
    if not usual.low < most < usual.high:
        return usual
    return replace(usual, high=most, reason=", where this size lies flat on its rim")


def _angle(layer: Mapping[str, Any], section: Section) -> Usual | None:
    """A layer's usual angle: of a carcass, from crown to bead, or of a belt, at the crown."""
    line = layer.get("line")
    if line not in section.names or layer.get("regions") is not None:
        return None
    there = section.points[section.names.index(line), :, 0]
    there = there == there  # NaN: the line is absent
    if there.all():
        return CARCASS_ANGLE
    return BELT_ANGLE if there[0] else None


def _numbers(part: Any, keys: Keys) -> Iterator[tuple[Keys, float]]:
    """All numbers in a part, and where they stand."""
    if isinstance(part, dict | list):
        for key, value in part.items() if isinstance(part, dict) else enumerate(part):
            yield from _numbers(value, (*keys, key))
    elif isinstance(part, int | float) and not isinstance(part, bool):
        yield keys, part


def _value(data: Mapping[str, Any], keys: Keys) -> Any:
    """The value at ``keys``, which may be left to its default, or in what is wrong."""
    try:
        return at(data, keys)
    except (KeyError, TypeError):
        return None


def _keys(data: Mapping[str, Any], path: str) -> Keys:
    """Where a path leads; nowhere where it is wrong, which is told elsewhere."""
    effects = {**dict.fromkeys(IDS, 0.0), **table(data, "effects")}
    try:
        return find({**data, "effects": effects}, path)
    except KeyError:
        return ()
