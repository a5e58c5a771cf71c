"""What must agree between the parts of a case, and between the case and its section.

All checks read plain data in which wrong values are WRONG, so that one mistake never hides
another one, nor causes one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from ..plugins import IDS
from .analysis import Analysis
from .calibration import MEASURED_SIGMA
from .meshable import Problems, levels, places
from .mistakes import Keys, dotted, suggestion
from .parts import WRONG, number
from .shape import KINDS, entries, explain, table, type_at, with_defaults

if TYPE_CHECKING:
    from ..section.section import Section

# what a variable cannot set: a fit that moved its own bounds or targets would mean nothing
FIXED = ("format", "variables", "targets", "uncertainties", "solver")


def problems(data: Mapping[str, Any], section: Section | None) -> Problems:
    """Every disagreement in ``data``; those with the section only where there is one."""
    yield from _effects(data)
    yield from _programs(data)
    yield from _names(data)
    yield from _targets(data)
    full = with_defaults(data)  # a number that is not written can vary too
    yield from _variables(full)
    yield from _uncertainties(full)
    chosen = table(data, "mesh").get("level")
    known = table(data, "mesh").get("levels")
    if isinstance(chosen, str) and isinstance(known, dict) and chosen not in known:
        yield ("mesh", "level"), f"is not one of the levels{suggestion(chosen, known)}"
    if section:
        yield from places(data, section)
        yield from levels(data, section)


def _effects(data: Mapping[str, Any]) -> Problems:
    for id in table(data, "effects"):
        if id not in IDS:
            yield ("effects", id), f"is not one of the effects{suggestion(id, IDS)}"


def _programs(data: Mapping[str, Any]) -> Problems:
    """A case may come from anybody, so it does not say which program runs."""
    for key in table(table(data, "solver"), "options"):
        if key == "command":
            yield (
                ("solver", "options", "command"),
                "a case cannot say which program runs: that is the user's to say, by"
                " --solver-command, TYRECAL_SOLVER_COMMAND or 'commands' of the settings file that"
                " 'tyrecal solvers' names",
            )


def _names(data: Mapping[str, Any]) -> Problems:
    """Materials exist and have the right kind; names differ by more than upper and lower case."""
    if str(data.get("name")).lstrip().startswith("*"):
        yield ("name",), "must not begin with *, which starts a keyword in the decks"
    for part in ("materials", "rebar_layers"):
        seen: dict[str, str] = {}
        for name in table(data, part):
            same = name.casefold().replace("-", "_").replace(" ", "_")  # in a deck
            first = seen.setdefault(same, name)
            if first != name:
                yield (part, name), f"differs from '{first}' only in upper case, '-', '_' or blanks"
    uses: list[tuple[Keys, Any, str]] = [
        (("rebar_layers", name), layer, "cord")
        for name, layer in table(data, "rebar_layers").items()
    ]
    uses += [(("solids", i), solid, "rubber") for i, solid in enumerate(entries(data, "solids"))]
    materials = table(data, "materials")
    for keys, part, kind in uses:
        wanted = part.get("material") if isinstance(part, dict) else None
        if not isinstance(wanted, str) or not materials:
            continue
        if wanted not in materials:
            hint = suggestion(wanted, materials)
            yield (*keys, "material"), f"is not one of the materials{hint}"
        else:
            found = table(materials, wanted).get("kind", kind)
            if found not in (kind, WRONG):
                yield (*keys, "material"), f"must be a {kind}, '{wanted}' is a {found}"


def _targets(data: Mapping[str, Any]) -> Problems:
    seen: dict[tuple[Any, ...], int] = {}
    default = Analysis.model_fields["highest_harmonic"].default
    highest = number({"highest_harmonic": default, **table(data, "analysis")}, "highest_harmonic")
    for i, mode in enumerate(entries(table(data, "targets"), "modes")):
        if not isinstance(mode, dict):
            continue
        c = number(mode, "c")
        if c is not None and highest is not None and c > highest:
            yield ("targets", "modes", i, "c"), f"must be at most highest_harmonic, {highest}"
        label = (c, number(mode, "m"), mode.get("kind"))
        if WRONG in label or None in label[:2]:
            continue
        first = seen.setdefault(label, i)
        if first != i:
            name = f"[{label[0]},{label[1]}]" + (f" {label[2]}" if label[2] else "")
            yield ("targets", "modes", i), f"the mode {name} is a target already"
    for i, target in enumerate(entries(table(data, "targets"), "footprint")):
        load = number(target, "load_N") if isinstance(target, dict) else None
        for quantity in MEASURED_SIGMA:
            if load is None or target.get(quantity) is None:
                continue
            first = seen.setdefault((load, quantity), i)
            if first != i:
                yield ("targets", "footprint", i), f"{quantity} at {load:g} N is a target already"


def _variables(data: Mapping[str, Any]) -> Problems:
    """Variables set numbers that exist, are not whole, allow the bounds, and are set once."""
    owners: dict[Keys, str] = {}
    data = {**data, "effects": {**dict.fromkeys(IDS, 0.0), **table(data, "effects")}}
    for name, here, path, keys, nowhere in _paths(data, "variables"):
        if nowhere:
            yield here, nowhere
        elif not keys:
            continue
        elif keys[0] in FIXED:
            yield here, f"a variable cannot set {keys[0]}"
        elif type_at(keys) is int:
            yield here, "is a whole number, which cannot vary"
        elif at(data, keys) is None:
            yield here, "has no value, and no default: write one"
        elif not _is_number(at(data, keys)):
            yield here, "leads to no number"
        elif keys in owners:
            yield here, f"is set by '{owners[keys]}' already"
        else:
            owners[keys] = name
            for bound in ("lower", "upper"):
                limit = number(data["variables"][name], bound)
                if limit is not None and (message := _refusal(data, keys, limit)):
                    yield ("variables", name, bound), f"{path} {message}"


def _uncertainties(data: Mapping[str, Any]) -> Problems:
    """Sources of error name numbers that exist, and make a difference to them."""
    data = {**data, "effects": {**dict.fromkeys(IDS, 0.0), **table(data, "effects")}}
    for name, here, path, keys, nowhere in _paths(data, "uncertainties"):
        id = path.removeprefix("effects.")
        if path.startswith("effects.") and id not in IDS:
            yield here, f"'{id}' is not one of the effects{suggestion(id, IDS)}"
        elif nowhere:
            yield here, nowhere
        elif keys and (keys[0] in FIXED or not _is_number(at(data, keys))):
            yield here, "leads to no number of the tyre"
        elif keys and at(data, keys) == 0 and number(data["uncertainties"][name], "percent"):
            yield here, "is 0, of which per cent are nothing: state 'absolute'"


def _paths(data: Mapping[str, Any], part: str) -> Iterator[tuple[str, Keys, str, Keys, str]]:
    """All paths that the entries of ``part`` set: name of the entry, place of the path, the path,
    the keys that it leads to, or why there are none (empty: a WRONG value is in the way)."""
    for name, entry in table(data, part).items():
        for i, path in enumerate(entries(entry, "sets")):
            if not isinstance(path, str):
                continue
            keys: Keys = ()
            nowhere = ""
            try:
                keys = find(data, path)
            except KeyError as error:
                nowhere = str(error.args[0])
            yield name, (part, name, "sets", i), path, keys, nowhere


def _refusal(data: Mapping[str, Any], keys: Keys, value: float) -> str | None:
    """Why the schema would not have ``value`` at ``keys``, judged in the part that holds it."""
    parent = keys[:-1]
    part, model = at(data, parent), type_at(parent)
    if not isinstance(part, dict):
        return None
    if keys[0] == "materials" and len(parent) == 2:
        model = KINDS.get(part.get("kind", ""))
    if not (isinstance(model, type) and issubclass(model, BaseModel)):
        return None
    try:
        model.model_validate({**part, keys[-1]: value})
    except ValidationError as error:
        for wrong, message in explain(error, parent):
            if wrong == keys:
                return message
    return None


def find(data: Mapping[str, Any] | BaseModel, path: str) -> Keys:
    """Keys of the dotted ``path``; none when a WRONG value stands in the way.

    KeyError, with what would be right, where there is no such path.
    """
    keys: Keys = ()
    here: Any = data
    for word in path.split("."):
        if here is WRONG:
            return ()
        key: str | int = word
        if isinstance(here, list):
            known = [str(i) for i in range(len(here))]
            key = int(word) if word in known else word
        elif isinstance(here, BaseModel):
            known, here = list(type(here).model_fields), here.__dict__
        else:
            known = list(here) if isinstance(here, Mapping) else []
        if word not in known:
            place = f" in '{dotted(keys)}'" if keys else " in the case"
            raise KeyError(f"there is no '{word}'{place}{suggestion(word, known)}")
        here, keys = here[key], (*keys, key)
    return keys


def at(data: Any, keys: Keys) -> Any:
    """The value at ``keys``, which exists."""
    for key in keys:
        data = getattr(data, str(key)) if isinstance(data, BaseModel) else data[key]
    return data


def _is_number(value: Any) -> bool:
    """Whether it is one, or a wrong value that is reported already."""
    return value is WRONG or (isinstance(value, int | float) and not isinstance(value, bool))
