"""Numbers of a case set by the name of a variable or by dotted path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from numbers import Real
from typing import Any, Literal, get_origin

from pydantic import BaseModel, ValidationError

from ..errors import InputError
from .case.checks import at, find, problems
from .case.identity import is_of_tyre
from .case.loaded import LoadedCase
from .case.mistakes import Keys, dotted, suggestion
from .case.parts import Setting, as_written
from .case.schema import Case
from .case.shape import explain, type_at
from .case.stations import read_section_of
from .number_units import unit_of
from .own_deck.numbers import as_known, canonical
from .plugins import IDS
from .resolve import resolved
from .state import PRESSURE_PATH, with_states_kept
from .usual import belts_on_one_side, refusal

IN_DECK = "deck.numbers."  # before the path of a number of a user's deck
MAX_MEANT = 3  # paths that the error for an unknown name suggests
# parts of a case whose numbers no other part and no mesh depends on: changes need no check
INDEPENDENT_PARTS = {
    "pressure_kPa",
    "deck",
    "materials",
    "rebar_layers",
    "rim",
    "cavity",
    "effects",
    "solver",
    "spin_rad_per_s",
    "point_mass",
    "road_spring",
    "splice",
}


def with_values(loaded: LoadedCase, values: Mapping[str, Setting]) -> LoadedCase:
    """A new case with variables (by name) or any of its numbers (by dotted path) set.

    A value can also be one of the words that the schema lists for a key, or None if the schema
    allows it. Values are in the unit of the numbers they set; a variable's bounds are not
    enforced. Raises InputError, in one sentence, for an unknown name or a value that the case
    cannot have.
    """
    changed = set_values(loaded, values)
    resolved(changed)
    return changed


def set_values(loaded: LoadedCase, values: Mapping[str, Setting]) -> LoadedCase:
    """Like `with_values`, without checking that the effects can be applied."""
    targets: dict[Keys, Setting] = {}
    tree: dict[Any, Any] = {}
    for name, value in values.items():
        is_word = value is None or isinstance(value, str)
        if not isinstance(value, Real) and (not is_word or name in loaded.case.variables):
            shown = as_written(value) if is_word else repr(value)
            raise InputError(f"{name} is {shown}, must be a number")
        variable = loaded.case.variables.get(name)
        numbers: Sequence[Setting] = [value]
        if variable and isinstance(value, Real):
            numbers = variable.numbers(value)
        for keys, number in zip(_keys(loaded, name), numbers, strict=True):
            if keys in targets:
                raise InputError(f"{name}: {dotted(keys)} is set twice")
            targets[keys] = _setting(loaded.case, keys, number)
    for keys, setting in targets.items():
        branch: Any = tree
        for key in keys[:-1]:
            branch = branch.setdefault(key, {})
        branch[keys[-1]] = setting
    case = _set(loaded.case, tree, ())
    has_words = any(isinstance(setting, str) for setting in targets.values())
    # a word, such as how the rim holds the bead, can change which rules and which mesh apply
    parts_to_check = set(tree) - (set() if has_words else INDEPENDENT_PARTS)
    section = loaded.drawn
    redrawn = "outline" in tree.get("section", {})
    if redrawn:
        section = read_section_of(case.section, loaded.folder)
    if parts_to_check:
        data = case.plain()
        for wrong, reason in problems(data, section):
            raise InputError(f"{dotted(wrong)} {reason}")
        meshed = "mesh" in parts_to_check or redrawn or has_words
        if section and meshed and (message := loaded.kind.folds(data, section)):
            raise InputError(message)
    return replace(loaded, case=case, drawn=section, as_read=loaded.as_read or loaded)


def overridden(loaded: LoadedCase, values: Mapping[str, Setting]) -> LoadedCase:
    """The case with the values that its user gives for one run, listed in ``overrides``.

    The value of a variable is its start (`start_values`). Targets keep the states in which they
    were measured. Raises what `with_values` does, and InputError for the path of a number that a
    variable sets.
    """
    values = {as_known(name, loaded.deck_numbers): value for name, value in values.items()}
    variables = loaded.case.variables
    for path in values.keys() - variables.keys():
        for name, variable in variables.items():
            if path in variable.sets:
                raise InputError(f"{path} is set by the variable '{name}': set {name} instead")
    changed = with_states_kept(loaded, with_values(loaded, values))
    as_it_is = (bool, str, type(None))
    given = {n: x if isinstance(x, as_it_is) else float(x) for n, x in values.items()}
    return replace(changed, overrides={**loaded.overrides, **given})


def unusual_value(loaded: LoadedCase, name: str, value: Setting) -> str | None:
    """Why ``value`` is unusual for a variable, or the number at a dotted path; None if it is not.

    The sentence has the usual range and what was probably meant. Raises InputError for an unknown
    name.
    """
    paths = paths_of(loaded, name)
    if value is None or isinstance(value, str):
        return None
    data = loaded.case.plain()
    messages = [refusal(data, loaded.drawn, keys, value) for keys in _keys(loaded, name)]
    if any(path.startswith("rebar_layers.") and path.endswith("angle_deg") for path in paths):
        messages += [message for _, message in belts_on_one_side(data, loaded.drawn)]
    names = [path.removeprefix("deck.numbers.") for path in paths]
    of_deck = loaded.kind.unusual({**loaded.deck_numbers, **dict.fromkeys(names, value)})
    messages += [of_deck[path] for path in names if path in of_deck]
    return next((message for message in messages if message), None)


def paths_of(loaded: LoadedCase, name: str) -> list[str]:
    """Dotted paths of the numbers that the variable or the path ``name`` sets. Raises InputError
    with a suggestion for an unknown name."""
    return [dotted(keys) for keys in _keys(loaded, name)]


def unit_named(loaded: LoadedCase, name: str) -> str:
    """The unit of the number that the variable or the path ``name`` sets, "" where it has none.
    Raises InputError as `paths_of` does."""
    return unit_of(paths_of(loaded, name)[0])


def value_at(loaded: LoadedCase, path: str) -> Any:
    """The value at a path of `paths_of`; None if the case has no number there."""
    return at(loaded.case, find(loaded.case, path))


def tyre_numbers(loaded: LoadedCase) -> dict[str, float]:
    """Numbers by path that make the tyre, and its pressure, in their own units: those that are not
    0 and that no variable sets. Whole numbers, which count something, are left out."""
    taken = {path for variable in loaded.case.variables.values() for path in variable.sets}
    own = {path: value_at(loaded, path) for path in _numbers(loaded.case.model_dump(), ())}
    numbers = {
        path: value
        for path, value in own.items()
        if (path == PRESSURE_PATH or is_of_tyre(path)) and not path.startswith(IN_DECK)
    }
    return {
        path: value
        for path, value in {**numbers, **loaded.deck_numbers}.items()
        if isinstance(value, float) and value and taken.isdisjoint((path, IN_DECK + path))
    }


def _keys(loaded: LoadedCase, name: str) -> list[Keys]:
    """Keys of each number that the variable or the dotted path ``name`` sets."""
    variables = loaded.case.variables
    paths = variables[name].sets if name in variables else [name]
    try:
        return [find(loaded.case, path) for path in paths]
    except KeyError as error:
        idle = loaded.kind.idle
        if (path := canonical(name, idle)) is not None:
            raise InputError(f"{name} {idle[path]}") from None
        if meant := " or ".join(f"'{path}'" for path in _meant(loaded, name)):
            raise InputError(f"there is no '{name}'; did you mean {meant}?") from None
        if "." in name:
            raise InputError(f"{name}: {error.args[0]}") from None
        known = suggestion(name, [*variables, "pressure_kPa"])
        raise InputError(f"there is no variable '{name}'{known}") from None


def _meant(loaded: LoadedCase, name: str) -> list[str]:
    """Suggestions for an unknown name: paths that end with it, or else, if it is one word, the
    variable or path whose last word is most like it."""
    dump = loaded.case.model_dump()
    numbers = dict.fromkeys([*_numbers(dump, ()), *(f"effects.{id}" for id in IDS)])
    if ends := [path for path in numbers if path.endswith(f".{name}")]:
        return ends[:MAX_MEANT]
    words = {path.rpartition(".")[2]: path for path in reversed(numbers)}
    words |= {name: name for name in (*loaded.case.variables, "pressure_kPa")}
    return [words[word] for word in get_close_matches(name, words, 1) if "." not in name]


def _numbers(part: Any, keys: Keys) -> Iterator[str]:
    """Dotted paths of all numbers of a case, stated or not."""
    if isinstance(part, dict | list):
        for key, value in part.items() if isinstance(part, dict) else enumerate(part):
            yield from _numbers(value, (*keys, key))
    elif not isinstance(part, str):
        yield dotted(keys)


def is_choice(keys: Keys) -> bool:
    """Whether the schema lists the words that can be set at ``keys``. None can be set in ``deck``,
    because the deck has been read by then."""
    return get_origin(type_at(keys)) is Literal and keys[0] != "deck"


def _setting(case: Case, keys: Keys, value: Setting) -> Setting:
    """``value`` in the type of the value at ``keys`` of the case: a number, true or false, a word.
    Raises InputError if it has another type."""
    old = at(case, keys)
    if is_choice(keys) and (value is None or isinstance(value, str)):
        return value
    if isinstance(old, str):
        raise InputError(f"{dotted(keys)} is text, '{old}': edit the case file")
    if value is None and isinstance(old, int | float | None):
        return None  # the schema accepts or refuses it
    if isinstance(old, bool) or isinstance(value, bool):
        if isinstance(old, bool) and isinstance(value, bool):
            return value
        kind = "true or false" if isinstance(old, bool) else "a number"
        raise InputError(f"{dotted(keys)} must be {kind}, got {as_written(value)}")
    if not isinstance(old, int | float | None):
        raise InputError(f"{dotted(keys)} is not a number, it cannot be {as_written(value)}")
    if value is None or isinstance(value, str):
        raise InputError(f"{dotted(keys)} must be a number, got {as_written(value)}")
    number = float(value)
    return int(number) if isinstance(old, int) and number.is_integer() else number


def _set(node: Any, tree: Any, keys: Keys) -> Any:
    """A copy of ``node``, at ``keys`` of the case, with the values of the nested dict ``tree``.

    Only the parts that contain a new value are copied and validated again; the rest is shared.
    """
    if not isinstance(tree, dict):
        return tree
    fields = node.__dict__ if isinstance(node, BaseModel) else node
    new: Any = list(fields) if isinstance(fields, list) else dict(fields)
    for key, branch in tree.items():
        new[key] = _set(fields[key], branch, (*keys, key))
    if not isinstance(node, BaseModel):
        return new
    try:
        return type(node).model_validate(new)
    except ValidationError as error:
        wrong, message = next(explain(error, keys))
        value: Any = tree
        for key in wrong[len(keys) :]:
            value = value.get(key, {}) if isinstance(value, dict) else {}
        got = "" if isinstance(value, dict) else f", got {as_written(value)}"
        raise InputError(f"{dotted(wrong)} {message}{got}") from None
