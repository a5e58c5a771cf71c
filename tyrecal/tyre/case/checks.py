"""Rules between the parts of a case, and between case and section: lines, regions, rows, and a mesh
that fits.

All checks read plain data in which wrong values are WRONG, so that one mistake never hides
another one, nor causes one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from ..footprint_quantities import FOOTPRINT_QUANTITIES
from ..own_deck.numbers import canonical
from ..plugins import IDS
from .mistakes import CaseData, Keys, dotted, suggestion
from .parts import WHOLE_BEAD, WRONG, number
from .schema import Analysis
from .shape import KINDS, entries, explain, table, type_at, with_defaults

if TYPE_CHECKING:
    from ..section.section import Section

Problems = Iterator[tuple[Keys, str]]
MAX_ELEMENTS = 20_000
# what a variable cannot set: a fit that moved its own bounds or targets would mean nothing
FIXED = ("format", "variables", "targets", "uncertainties", "solver")


def problems(data: CaseData, section: Section | None) -> Problems:
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
    if section and not table(data, "deck"):  # which has its own mesh and materials
        yield from places(data, section)
        yield from levels(data, section)


def _effects(data: CaseData) -> Problems:
    for id in table(data, "effects"):
        if id not in IDS:
            yield ("effects", id), f"is not one of the effects{suggestion(id, IDS)}"


def _programs(data: CaseData) -> Problems:
    """A case may come from anybody, so it does not say which program runs."""
    for key in table(table(data, "solver"), "options"):
        if key == "command":
            yield (
                ("solver", "options", "command"),
                "a case cannot say which program runs: set it with --solver-command,"
                " TYRECAL_SOLVER_COMMAND or 'commands' of the settings file that"
                " 'tyrecal solvers' names",
            )


def _names(data: CaseData) -> Problems:
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
            actual = table(materials, wanted).get("kind", kind)
            if actual not in (kind, WRONG):
                yield (*keys, "material"), f"must be a {kind}, '{wanted}' is a {actual}"


def _targets(data: CaseData) -> Problems:
    """Disagreements of targets with each other and with the analysis."""
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
        state = tuple(mode.get(key) for key in ("pressure_kPa", "rim", "load_N", "symmetry"))
        if WRONG in (*label, *state) or None in label[:2]:
            continue
        first = seen.setdefault((*label, *state), i)
        if first != i:
            name = f"[{label[0]},{label[1]}]" + (f" {label[2]}" if label[2] else "")
            there = " in this state" if any(state) else ""
            yield ("targets", "modes", i), f"the mode {name} is a target already{there}"
    for i, target in enumerate(entries(table(data, "targets"), "footprint")):
        load = number(target, "load_N") if isinstance(target, dict) else None
        for quantity in FOOTPRINT_QUANTITIES:
            if load is None or target.get(quantity) is None:
                continue
            first = seen.setdefault((load, number(target, "pressure_kPa"), quantity), i)
            if first != i:
                yield ("targets", "footprint", i), f"{quantity} at {load:g} N is a target already"


def _variables(data: CaseData) -> Problems:
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


def _uncertainties(data: CaseData) -> Problems:
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
            yield here, "is 0, and a share of 0 is 0: state 'absolute'"


def _paths(data: CaseData, part: str) -> Iterator[tuple[str, Keys, str, Keys, str]]:
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


def _refusal(data: CaseData, keys: Keys, value: float) -> str | None:
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


def find(data: CaseData | BaseModel, path: str) -> Keys:
    """Keys of the dotted ``path``; none when a WRONG value stands in the way.

    KeyError, with what would be right, where there is no such path.
    """
    keys: Keys = ()
    here: Any = data
    for word in _words(data, path):
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


def _words(data: CaseData | BaseModel, path: str) -> list[str]:
    """The keys that a path names; of a number of the deck, as in `material RUBBER / DENSITY /
    density`, those under which it is known."""
    if "/" not in path:
        return path.split(".")
    deck = data.get("deck") if isinstance(data, Mapping) else getattr(data, "deck", None)
    known = deck.get("numbers") if isinstance(deck, Mapping) else getattr(deck, "numbers", None)
    return ["deck", "numbers", canonical(path.removeprefix("deck.numbers."), known or ()) or path]


def at(data: Any, keys: Keys) -> Any:
    """The value at ``keys``, which exists."""
    for key in keys:
        data = getattr(data, str(key)) if isinstance(data, BaseModel) else data[key]
    return data


def _is_number(value: Any) -> bool:
    """Whether it is one, or a wrong value that is reported already."""
    return value is WRONG or (isinstance(value, int | float) and not isinstance(value, bool))


def places(data: CaseData, section: Section) -> Problems:
    """Lines and regions exist, and every part of the section has a material."""
    lines = list(section.names)
    regions = [name for name, _ in section.regions]
    for name, layer in table(data, "rebar_layers").items():
        line = layer.get("line") if isinstance(layer, dict) else None
        if isinstance(line, str) and line not in lines:
            hint = suggestion(line, lines)
            yield ("rebar_layers", name, "line"), f"is not a line of the section{hint}"
        for j, region in enumerate(entries(layer, "regions")):
            if isinstance(region, str) and region not in regions:
                hint = suggestion(region, regions)
                yield ("rebar_layers", name, "regions", j), f"is not a region of the section{hint}"
    for i, gauge in enumerate(entries(table(data, "section"), "gauges")):
        for key, known in (("regions", regions), ("between", lines)):
            for j, word in enumerate(entries(gauge, key)):
                if isinstance(word, str) and word not in known:
                    place = ("section", "gauges", i, key, j)
                    yield place, f"is not one of the section's{suggestion(word, known)}"
    bare = {(region, gap) for region in regions for gap in range(len(lines) - 1)}
    whole = True
    for i, solid in enumerate(entries(data, "solids")):
        where, between = entries(solid, "regions"), entries(solid, "between")
        whole &= isinstance(solid, dict) and WRONG not in solid.values()
        for j, region in enumerate(where):
            if isinstance(region, str) and region not in regions:
                hint = suggestion(region, regions)
                yield ("solids", i, "regions", j), f"is not a region of the section{hint}"
        unknown = [line for line in between if line not in lines]
        for j, line in enumerate(between):
            if isinstance(line, str) and line in unknown:
                hint = suggestion(line, lines)
                yield ("solids", i, "between", j), f"is not a line of the section{hint}"
        low, high = 0, len(lines) - 1
        if between:
            if unknown or len(between) != 2:
                whole = False
                continue
            low, high = lines.index(between[0]), lines.index(between[1])
            if low >= high:
                yield ("solids", i, "between"), "must name the inner line first, then the outer"
                whole = False
        bare -= {(r, gap) for r in where or regions for gap in range(low, high)}
    if bare and whole and isinstance(data.get("solids"), list):
        region, gap = min(bare, key=lambda place: (regions.index(place[0]), place[1]))
        yield (
            ("solids",),
            (
                f"must cover the section: region '{region}' has no material"
                f" between '{lines[gap]}' and '{lines[gap + 1]}'"
            ),
        )


def levels(data: CaseData, section: Section) -> Problems:
    """Every mesh level fits the section."""
    gaps = len(section.names) - 1
    regions = [name for name, _ in section.regions]
    for name, level in table(table(data, "mesh"), "levels").items():
        here: Keys = ("mesh", "levels", name)
        elements = table(level, "elements")
        if isinstance(level, dict) and isinstance(level.get("elements"), dict):
            for region in elements:
                if region not in regions:
                    hint = suggestion(region, regions)
                    yield (*here, "elements", region), f"is not a region of the section{hint}"
            for region in regions:
                if region not in elements:
                    yield (*here, "elements", region), "must be given, the section has this region"
        for key in ("rows", "grading"):
            counts = level.get(key) if isinstance(level, dict) else None
            if isinstance(counts, list) and len(counts) != gaps:
                each = "one for each gap between two lines"
                yield (*here, key), f"must have {gaps} entries, {each}, got {len(counts)}"
        count = _sum(elements.values()) * _sum(entries(level, "rows"))
        if count > MAX_ELEMENTS:
            yield here, f"must have at most {MAX_ELEMENTS} elements, elements x rows is {count}"


def folds(data: CaseData, section: Section) -> str | None:
    """Why the section cannot be meshed at the chosen level of ``data``, which is right so far."""
    import numpy as np

    from ..section.mesh import kept_mesh
    from ..section.section import with_gauges

    mesh = data["mesh"]
    level = mesh["levels"][mesh["level"]]
    elements = tuple(level["elements"][region] for region, _ in section.regions)
    grading = tuple(level.get("grading") or ()) or None
    whole_bead = table(data, "rim").get("holds", WHOLE_BEAD) == WHOLE_BEAD
    gauges = tuple(
        (tuple(g.get("regions") or ()), tuple(g["between"]), float(g["factor"]))
        for g in data["section"].get("gauges") or ()
    )
    try:
        with np.errstate(all="ignore"):
            built = kept_mesh(
                with_gauges(section, gauges),
                elements,
                tuple(level["rows"]),
                "8" in mesh["element"],
                grading,
                whole_bead,
            )
    except ValueError as error:
        return str(error)
    if not np.isfinite(list(built.nodes.values())).all():
        return "two lines of the section run through one point, no mesh fits between them"
    return None


def _sum(values: Iterable[Any]) -> int:
    return sum(v for v in values if isinstance(v, int))
