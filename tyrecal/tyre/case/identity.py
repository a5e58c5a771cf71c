"""Hash that identifies the tyre of a case: the same for two cases of one tyre in other states.

Results record it, so that a command can refuse the results of another tyre.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from hashlib import sha256
from typing import Any

from ...files import read_bytes
from .checks import find
from .loaded import LoadedCase
from .mistakes import Keys

# Parts of a case file that make the tyre. True: all keys of the part count; a dict: only its keys
# count. Names, mesh, pressure, road, requested modes, targets, uncertainties and the solver do not.
TYRE: dict[str, Any] = {
    "section": {"gauges": True, "outline": True},
    "deck": {"numbers": True, "parts": True, "gauges": True},
    "materials": True,
    "solids": True,
    "rebar_layers": True,
    "rim": True,
    "cavity": True,
    "spin_rad_per_s": True,
    "point_mass": True,
    "road_spring": True,
    "splice": True,
    "analysis": {"static_moduli": True, "vibration_frequency_Hz": True},
}
# Keys of these parts that do not make another tyre: how the rim is held, and the name of the
# outline's file, whose curves are hashed themselves.
STATE: tuple[Keys, ...] = (("rim", "free"), ("section", "outline", "file"))


def tyre_sha256(loaded: LoadedCase) -> str:
    """Hash of the tyre as 64 hexadecimal digits, the same however its case is written.

    It changes with every number that is physics (in the unit of its key) and with what is a
    variable, by name and path; not with a variable's value, nor with the state: pressure, load,
    road, and whether the rim is held or free. Keys at their default, and effects of 0, count as
    absent. It changes with the text of the case's own templates. Raises OSError.
    """
    text = json.dumps(_content(loaded), sort_keys=True, allow_nan=False)
    return sha256(text.encode()).hexdigest()


def is_of_tyre(path: str) -> bool:
    """Whether another number at a path makes another tyre: dotted, or of a user's deck, but not the
    name of a variable."""
    if tuple(path.split(".")) in STATE:
        return False
    if "/" in path:  # a number of the user's deck, as material RUBBER / HYPERELASTIC / C10
        return True
    part, _, rest = path.partition(".")
    known = TYRE.get(part, part == "effects")
    return known is True or (known is not False and rest.partition(".")[0] in known)


def _content(loaded: LoadedCase) -> dict[str, Any]:
    """The tyre as plain data, without the values of its variables."""
    case = loaded.case
    data: dict[str, Any] = case.model_dump(include=TYRE, exclude_defaults=True)
    data["effects"] = {id: value for id, value in case.effects.items() if value}
    for keys in STATE:
        _leave_out(data, keys)
    for variable in case.variables.values():
        for path in variable.sets:
            with suppress(KeyError):  # an effect of a blind trial may have divided the layer
                _leave_out(data, find(case, path))
    content = {
        "tyre": _plain(data),
        "variables": {name: sorted(v.sets) for name, v in case.variables.items()},
        "drawn": loaded.kind.content_sha256(loaded.drawn),
    }
    templates = _templates(loaded)
    return {**content, "templates": templates} if templates else content


def _templates(loaded: LoadedCase) -> dict[str, str]:
    """Hash of each of the case's own templates, by its place in their folder."""
    hashes = {}
    for path in loaded.template_files:
        name = path.relative_to(loaded.folder / str(loaded.case.templates)).as_posix()
        text = read_bytes(path).replace(b"\r\n", b"\n")
        hashes[name] = sha256(text).hexdigest()
    return hashes


def _leave_out(data: Any, keys: Keys) -> None:
    """Set the value at ``keys`` of ``data`` to None, which `_plain` leaves out, if it is there."""
    *way, last = keys
    for key in way:
        if not _has(data, key):
            return
        data = data[key]
    if _has(data, last):
        data[last] = None


def _has(data: Any, key: str | int) -> bool:
    if isinstance(data, list):
        return isinstance(key, int) and key < len(data)
    return isinstance(data, dict) and key in data


def _plain(value: Any) -> Any:
    """The value with numbers as floats, -0.0 as 0.0, and without keys that are empty."""
    if isinstance(value, Mapping):
        entries = {key: _plain(each) for key, each in value.items()}
        return {key: each for key, each in entries.items() if each not in (None, {}, [])}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value) + 0.0
    return value
