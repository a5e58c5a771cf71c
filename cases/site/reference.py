"""The tables of the reference, made from the code, so that they lack no key and no keyword.

    python cases/site/reference.py

writes `cases/case_keys.md`, for readers of the repository. The other tables are made when the site
is built: `conf.py` puts them where a page has `[[NAME]]` (`TABLES`). `tests/test_site.py` compares.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from pathlib import Path
from textwrap import dedent
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

import notebook
from effect_pictures import picture
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from ruamel.yaml import YAML
from tyrecal_solvers.language.table import RULES

from tyrecal.cli.main import EXIT_CODES
from tyrecal.studies import result_types
from tyrecal.studies.effects import CatalogueEntry, EffectResult
from tyrecal.studies.result import Provenance
from tyrecal.tyre.case.editor import meanings
from tyrecal.tyre.case.schema import Case
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.number_units import UNIT_BY_ENDING
from tyrecal.tyre.usual import BELT_ANGLE, CARCASS_ANGLE, RUBBER_DENSITY, USUAL
from tyrecal.units import printed_unit

CASES = Path(__file__).parents[1]
CASE_KEYS = CASES / "case_keys.md"
UNITS = {  # by the end of a key, the longest first
    **UNIT_BY_ENDING,
    **{"to_0.05_Hz": "", "per_Pa": "1/Pa", "Nm_per_rad": "N m/rad", "percent": "%"},
    **{"mm": "mm", "N": "N", "s": "s"},
}
LIMITS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}  # the first letter tells lower from upper
WORDS = {str: "text", bool: "true or false", float: "number", int: "integer", Any: "any"}
MAX_EXAMPLE = 45  # characters
USUAL_OF_KINDS = {  # of kinds of a part, which have ranges of their own
    "materials.NAME.density_kg_per_m3": [f"rubber {RUBBER_DENSITY.span}"],
    "rebar_layers.NAME.angle_deg": [f"carcass {CARCASS_ANGLE.span}", f"belt {BELT_ANGLE.span}"],
}
EXAMPLES = {  # of keys that neither a shipped case nor a guide has
    "section.gauges[].between": "[inner, ply]",
    "section.gauges[].factor": "1.1",
    "section.gauges[].regions": "[crown]",
    "solids[].between": "[inner, ply]",
    "solids[].regions": "[bead]",
    "rebar_layers.NAME.regions": "[bead]",
    "rebar_layers.NAME.spacing_deg": "0.3",
    "mesh.hourglass_stiffness_Pa": "1e4",
    "mesh.levels.NAME.elements": "{crown: 8, bead: 2}",
    "materials.NAME.loss_factor": "0.1",
    "deck.parts": "{tread: [TREAD]}",
    "deck.numbers": "{A_belt: 0.21}",
    "effects": "{bead_filler: 3}",
    "templates": "my_templates",
    "targets.source": "modal test of 3 May",
    "targets.footprint[].pressure_kPa": "200",
    "solver.options": "{licence_wait_s: 600}",
}
COLUMNS = {  # places of keywords, as `solvers/language/honour.py` names them
    "deck": "your deck",
    "deck step": "its steps",
    "section": "section",
    "revolve": "revolved tyre",
    "step": "steps",
}
SHARED = {  # meanings of keys that mean the same in every result
    "c": "waves round the circumference",
    "m": "nodal circles on the belt",
    "kind": "only of [0,0]: axial (lateral) or torsional",
    "design": "name of the design: initial, fitted or set",
    "frequency_Hz": "frequency",
    "sigma_Hz": "standard deviation of the measured frequency",
    "pressure_kPa": "inflation pressure",
    "load_N": "load on the road; 0: none",
    "rim": "how the rim was held",
    "symmetry": "symmetry about the patch",
    "multiplicity": "2: a pair of modes",
    "provenance": "origin: see provenance below",
}


class Entry(NamedTuple):
    """A key of a file."""

    path: str  # NAME: any name; []: each entry of a list
    meaning: str
    kind: str  # type and range
    default: str  # as in the file, "" without one
    is_required: bool

    @property
    def unit(self) -> str:
        """The unit that the key names, "" without one."""
        key = self.path.rpartition(".")[2].removesuffix("[]")
        ends = sorted(UNITS, key=len, reverse=True)
        return printed_unit(next((UNITS[e] for e in ends if key.endswith(f"_{e}")), ""))


def entries(model: type, prefix: str = "") -> Iterator[Entry]:
    """All keys of a file with this content, in its order."""
    for key, annotation, default in _fields(model):
        path = f"{prefix}{key.alias or key.name}"
        is_shown = default not in (..., None, "", []) and not isinstance(default, BaseModel | dict)
        shown = written(default) if is_shown else ""
        meaning = meanings(model).get(key.name) or SHARED.get(key.name, "")
        yield Entry(path, meaning, kind(annotation), shown, default is ...)
        for step, part in _parts(annotation):
            if part is not Provenance:
                yield from entries(part, f"{path}{step}.")


class _Key(NamedTuple):
    name: str
    alias: str | None


def _fields(model: type) -> Iterator[tuple[_Key, Any, Any]]:
    """Name, annotation and default (... without one) of each field."""
    if issubclass(model, BaseModel):
        for name, field in model.model_fields.items():
            default = ... if field.is_required() else field.get_default(call_default_factory=True)
            yield _Key(name, field.alias), Annotated[field.annotation, field], default
    else:
        hints = get_type_hints(model, include_extras=True)
        for each in fields(model):
            default = ... if each.default is MISSING else each.default
            yield _Key(each.name, None), hints[each.name], default


def _parts(annotation: Any) -> Iterator[tuple[str, type]]:
    """The classes in a value: the step to each (`.NAME`, `[]` or none), and the class."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        inner = inner[:1]
    if inspect.isclass(annotation) and (
        issubclass(annotation, BaseModel) or is_dataclass(annotation)
    ):
        yield "", annotation
    named = getattr(origin, "__name__", "") in ("dict", "Mapping")
    step = ".NAME" if named else "[]" if origin in (list, tuple) else ""
    for each in inner:
        yield from ((step + more, part) for more, part in _parts(each))


def kind(annotation: Any, limits: dict[str, str] | None = None) -> str:
    """Type and range of a value in words."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        own = {end: words for each in inner[1:] for end, words in _limits(each).items()}
        return kind(inner[0], own | (limits or {}))
    if origin is Literal:
        return ", ".join(f"`{written(each)}`" for each in inner)
    if origin in (list, tuple):
        return "list" if list(_parts(annotation)) else f"list of {kind(inner[0])}"
    if getattr(origin, "__name__", "") in ("dict", "Mapping"):
        return "keys" if list(_parts(annotation)) else f"by name: {kind(inner[1])}"
    if inner:
        kinds = [kind(each, limits) for each in inner if each is not type(None)]
        return " or ".join(dict.fromkeys(kinds))
    return f"{WORDS.get(annotation, 'keys')} {', '.join((limits or {}).values())}".strip()


def _limits(metadata: Any) -> dict[str, str]:
    """The lower and the upper limit that a constraint sets."""
    if isinstance(metadata, FieldInfo):
        return {end: words for each in metadata.metadata for end, words in _limits(each).items()}
    return {
        name[0]: f"{sign} {getattr(metadata, name):g}"
        for name, sign in LIMITS.items()
        if getattr(metadata, name, None) is not None
    }


def written(value: Any) -> str:
    """A value as a case file has it, in one line."""
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(written, value))}]"
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text.strip('"') if isinstance(value, str) else text


@cache
def examples() -> dict[str, str]:
    """A value of each key that a shipped case, or a block of a guide, has."""
    paths = [CASES / "p235_75r17.yaml", *sorted(CASES.glob("*.yaml")), CASES / "ring_3d/ring.yaml"]
    texts = [path.read_text(encoding="utf-8") for path in paths]
    for guide in sorted(CASES.glob("*.md")):
        blocks = re.split(r"```.*?```", text := guide.read_text(encoding="utf-8"), flags=re.S)
        texts += re.findall(r"```yaml\n(.*?)```", text, re.S)
        texts += [m for each in blocks for m in re.findall(r"(?m)(?:^    .*\n)+", each)]
    values: dict[str, str] = {}

    def note(value: Any, path: str) -> None:
        text = written(value)
        if value not in (None, [], "") and not isinstance(value, dict) and len(text) <= MAX_EXAMPLE:
            values.setdefault(path, text)
        for key, below in value.items() if isinstance(value, dict) else ():
            note(below, f"{path}.{key}".lstrip("."))
            note(below, f"{path}.NAME")
        for below in value if isinstance(value, list) else ():
            note(below, f"{path}[]")

    for text in texts:
        try:
            content = YAML(typ="safe").load(dedent(text))
        except Exception:  # a block that is no YAML
            continue
        if isinstance(content, dict) and content.keys() <= Case.model_fields.keys():
            note(content, "")
    return {**EXAMPLES, **values}


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown."""
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(c.replace("|", r"\|") for c in row) + " |" for row in lines)


def case_entries() -> dict[str, Entry]:
    """The keys of a case by path; a key of rubber and cord once."""
    keys: dict[str, Entry] = {}
    for each in entries(Case):
        if each.path in keys and each.kind != keys[each.path].kind:
            each = each._replace(kind=f"{keys[each.path].kind}, {each.kind}")
        keys[each.path] = each
    return keys


def usual_range(path: str) -> str:
    """The usual range of a key in words, with those of kinds of its part."""
    usual = USUAL.get(path.replace("NAME", "*").replace("[]", ".*"))
    return ", ".join([*([usual.span] if usual else []), *USUAL_OF_KINDS.get(path, [])])


def case_row(key: Entry) -> list[str]:
    """The row of a key of a case."""
    example = examples().get(key.path) or key.default
    return [
        f"`{key.path}`",
        key.meaning,
        key.kind,
        key.unit,
        "required" if key.is_required else key.default,
        usual_range(key.path),
        f"`{example}`" if example else "",
    ]


def case_keys() -> str:
    """The page of all keys of a case."""
    groups: dict[str, list[list[str]]] = {}
    for key in case_entries().values():
        groups.setdefault(re.split(r"[.\[]", key.path)[0], []).append(case_row(key))
    groups = {"the tyre": [rows.pop() for rows in groups.values() if len(rows) == 1]} | groups
    head = "key", "meaning", "type, range", "unit", "default", "usual", "example"
    parts = [f"## {name}\n\n{table(head, rows)}\n" for name, rows in groups.items() if rows]
    return HEAD + "\n" + "\n".join(parts)


HEAD = """\
# Keys of a case file

For users who write or read a case file. You get every key, with examples, written from the code by
`python cases/site/reference.py`. Look up what you need. `NAME` is a name of yours, `[]` each entry
of a list. Sub-keys are required only if their key is given. [More](README.md#the-case-file).
"""


def result_keys() -> str:
    """All keys of all result files."""
    head = "key", "meaning", "type", "unit"
    parts = []
    for model in result_types().values():
        content, prefix = (EffectResult, "[].") if model.stem == "effects" else (model, "")
        rows = [
            [f"`{e.path}`", e.meaning, e.kind, e.unit]
            for e in entries(content, prefix)
            if e.path not in ("format", "provenance")
        ]
        parts.append(f"## {model.stem}.json\n\n{table(head, rows)}")
    rows = [[f"`{e.path}`", e.meaning, e.kind, e.unit] for e in entries(Provenance)]
    return "\n\n".join([*parts, f"## provenance\n\n{table(head, rows)}"])


def effects() -> str:
    """All effects: explanation, picture and properties."""
    parts = []
    for id, effect in catalogue().items():
        entry = CatalogueEntry.of(effect, [])
        size = max(entry.high, entry.low, key=abs)
        similar = ", ".join(f"[{each}](#{each})" for each in entry.aliases)
        rows = {
            "case file": f"`effects: {{{id}: {size:.4g}}}`",
            "parameter": f"{entry.symbol}, {entry.low:.4g} to {entry.high:.4g} {entry.unit}",
            "in the deck": ", ".join(f"`{name}`" for name in entry.changes),
            "modes": entry.signature,
            "proof": entry.toggle,
            "similar effects": similar or "none",
            "in your own deck": "yes" if effect.add_to_deck else "no",
            "solver needs": f"`{effect.needs}`" if effect.needs else "nothing special",
        }
        words = "\n\n".join(" ".join(part.split()).replace("``", "`") for part in entry.about)
        title = f"({id})=\n## {entry.title} (`{id}`)"
        parts += [title, words, picture(id), table(("property", ""), rows.items())]
    return "\n\n".join(parts)


def keywords() -> str:
    """All keywords of ABAQUS decks that a reader honours, and with which parameters."""
    rows = []
    for name, rule in sorted(RULES.items()):
        if not rule.is_output and rule.options_at:
            cells = [_honoured(rule.options_at.get(place)) for place in COLUMNS]
            rows.append([f"`*{name}`", *cells, rule.calculix])
    skipped = ", ".join(f"`*{name}`" for name, rule in sorted(RULES.items()) if rule.is_output)
    head = "keyword", *COLUMNS.values(), "not in CalculiX, because"
    return f"{table(head, rows)}\n\nThese change no answer and are skipped: {skipped}."


def _honoured(options: Mapping[str, Iterable[str] | None] | None) -> str:
    """The options that are honoured at a place, with their values where not all are."""
    if options is None:
        return ""
    shown = {name: "/".join(filter(None, values or ())) for name, values in options.items()}
    return ", ".join(f"{name}={each}" if each else name for name, each in shown.items()) or "yes"


def exit_codes() -> str:
    """All exit codes of the command line."""
    return table(
        ("exit code", "meaning"), ([str(code), words] for code, words in EXIT_CODES.items())
    )


TABLES = {
    "notebook": notebook.markdown,
    "results": result_keys,
    "effects": effects,
    "keywords": keywords,
    "exit codes": exit_codes,
}

if __name__ == "__main__":
    CASE_KEYS.write_text(case_keys(), encoding="utf-8")
