"""Ways in which effects change a case."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from ...errors import InputError
from ..case import Case, LoadedCase
from ..case.parts import Gauge, Part, Rubber, Solid

P = TypeVar("P", bound=Part)


def changed(loaded: LoadedCase, **parts: Any) -> LoadedCase:
    """The case with whole parts of it (``materials=...``) replaced, and checked by the schema.
    Raises pydantic's ValidationError, a ValueError."""
    return replace(loaded, case=Case.model_validate({**loaded.case.__dict__, **parts}))


def with_part(part: P, **values: Any) -> P:
    """A part of the case with some of its values replaced, checked as in `changed`."""
    return type(part).model_validate({**part.__dict__, **values})


def unused(name: str, taken: Iterable[str]) -> str:
    """``name``, or with a number, 2 on, behind it where a deck could not tell it from one taken."""
    known = {other.casefold().replace("-", "_") for other in taken}
    count = 2
    new = name
    while new.casefold().replace("-", "_") in known:
        new, count = f"{name}_{count}", count + 1
    return new


def with_rubbers(loaded: LoadedCase, change: Callable[[Rubber], Rubber]) -> LoadedCase:
    """The case with all its rubbers changed."""
    materials = {
        name: change(material) if isinstance(material, Rubber) else material
        for name, material in loaded.case.materials.items()
    }
    return changed(loaded, materials=materials)


def with_rubbers_at(
    loaded: LoadedCase,
    regions: list[str],
    between: tuple[str, str],
    ending: str,
    change: Callable[[Rubber], Rubber],
) -> LoadedCase:
    """The case with the rubbers of some regions changed, between two lines (inner, outer).

    Each gets a copy under its name and ``ending``; later entries of ``solids`` override earlier
    ones, so each entry is repeated for the part of the place that it claims.
    """
    lines = loaded.section.names
    low, high = lines.index(between[0]), lines.index(between[1])
    materials: dict[str, Any] = dict(loaded.case.materials)
    copies: dict[str, str] = {}
    solids = list(loaded.case.solids)
    for solid in loaded.case.solids:
        where = [region for region in regions if region in (solid.regions or regions)]
        own = [lines.index(name) for name in solid.between or (lines[0], lines[-1])]
        inner, outer = max(low, own[0]), min(high, own[1])
        if not where or inner >= outer:
            continue
        if solid.material not in copies:
            copies[solid.material] = unused(f"{solid.material}_{ending}", materials)
            materials[copies[solid.material]] = change(materials[solid.material])
        span = [lines[inner], lines[outer]]
        solids.append(Solid(material=copies[solid.material], regions=where, between=span))
    return changed(loaded, materials=materials, solids=solids)


def with_gauge(
    loaded: LoadedCase, between: tuple[str, str], regions: list[str], factor: float
) -> LoadedCase:
    """The case with one more factor on the thickness between two lines, inner and outer, of some
    regions. The drawn section stays: the factor acts on it when the case is resolved."""
    section = loaded.case.section
    gauge = Gauge(between=list(between), regions=regions, factor=factor)
    return changed(loaded, section=with_part(section, gauges=[*(section.gauges or []), gauge]))


def with_layers(loaded: LoadedCase, layers: Mapping[str, Any]) -> LoadedCase:
    """The case with layers of cords added, or replaced where their name is taken."""
    return changed(loaded, rebar_layers={**loaded.case.rebar_layers, **layers})


def on_spindle(loaded: LoadedCase, key: str, compliance: float) -> LoadedCase:
    """The case with that much more compliance at the rim's reference point, in the unit of the
    ``key`` of ``rim.spindle``. Raises InputError."""
    rim = loaded.case.rim
    if rim.free:
        raise InputError("must be 0 where the rim is free: there is no spindle")
    if compliance < 0:
        raise InputError("must be at least 0")
    spindle = with_part(rim.spindle, **{key: getattr(rim.spindle, key) + compliance})
    return changed(loaded, rim=with_part(rim, spindle=spindle))
