"""The case of a user's deck, ready to be written beside it."""

from __future__ import annotations

import re
from typing import Any

from ..own_deck.flat import Flat
from ..own_deck.own_deck import OwnDeck
from ..templates import environment, render
from .case_text import plain_text

RANGE = 5.0  # a variable's bounds over its start, and under it


def own_case(deck: OwnDeck, flat: Flat, size: str, pressure_kPa: float | None) -> str:
    """YAML of a case whose deck is ``deck``: what a fit most often changes is a variable, the
    layers' areas and the rubbers' first constants."""
    env = environment("case", None)
    env.filters["text"] = plain_text
    r, z = flat.mesh.reference
    names: dict[str, Any] = {
        "file": deck.path.name,
        "units": deck.units,
        "name": deck.path.stem,
        "size": size,
        "pressure_kPa": flat.pressure_Pa / 1e3 if pressure_kPa is None else pressure_kPa,
        "static_moduli": "long_term" if flat.long_term else "instantaneous",
        "r": r,
        "z": z,
        "variables": [
            {
                "name": name,
                "sets": paths,
                "start": deck.numbers[paths[0]],
                "lower": deck.numbers[paths[0]] / RANGE,
                "upper": deck.numbers[paths[0]] * RANGE,
            }
            for name, paths in _variables(deck, flat).items()
        ],
    }
    return render(env, "own_deck.yaml.j2", names)


def _variables(deck: OwnDeck, flat: Flat) -> dict[str, list[str]]:
    """Paths by the name of the variable that sets them: layers of one cord and area are one."""
    found: dict[str, list[str]] = {}
    groups: dict[tuple[str, float], list[str]] = {}
    for path, value in deck.numbers.items():
        head, _, field = path.rpartition(" / ")
        if field == "area":
            name = head.rpartition("rebar ")[2]
            of = next((ply.material for ply in flat.plies if ply.name == name), "")
            groups.setdefault((of, value), []).append(path)
    for (material, _), paths in groups.items():
        found[_name(f"A_{material}", found)] = paths
    for material in dict.fromkeys(flat.materials):
        for field in ("C10", "mu", "mu1"):
            path = f"material {material} / HYPERELASTIC / {field}"
            if deck.numbers.get(path, 0.0) > 0:
                found[_name(f"{field}_{material}", found)] = [path]
    return found


def _name(words: str, taken: dict[str, list[str]]) -> str:
    plain = re.sub(r"\W", "_", words)[:50]
    count = sum(name.startswith(plain) for name in taken)
    return f"{plain}_{count + 1}" if plain in taken else plain
