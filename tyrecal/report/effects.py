"""The catalogue of effects in words: as a table, one effect at length, signatures."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np

from ..studies.signature import Signature, rms
from ..tyre.effects import Effect

WIDTH = 98


def effect_entry(effect: Effect, solvers: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """An effect as JSON; solvers: those installed, as `solver.installed` says."""
    return {
        "id": effect.id,
        "title": effect.title,
        "symbol": effect.symbol,
        "unit": effect.unit,
        "low": effect.low,
        "high": effect.high,
        "about": about(effect),
        "changes": list(effect.changes),
        "signature": effect.signature,
        "toggle": effect.toggle,
        "aliases": list(effect.aliases),
        "solvers": [s["name"] for s in solvers if effect.within(s["capabilities"])],
    }


def about(effect: Effect) -> list[str]:
    """What it is, and what it does to the case: the words that stand in the effect's own file."""
    module = inspect.getdoc(sys.modules[effect.add.__module__]) or ""
    return [part for part in (module, inspect.getdoc(effect.add) or "") if part]


def effect_text(entry: Mapping[str, Any]) -> str:
    """One effect at length."""
    unit = f" {entry['unit']}" if entry["unit"] else ""
    size = max(entry["high"], entry["low"], key=abs)
    rows = {
        "parameter": f"{entry['symbol']}, {entry['low']:g} to {entry['high']:g}{unit}; 0: absent",
        "case file": f"effects: {{{entry['id']}: {size:g}}}",
        "in the deck": ", ".join(entry["changes"]),
        "modes": entry["signature"],
        "proof": entry["toggle"],
        "hard to tell from": ", ".join(entry["aliases"]) or "no other",
        "solvers": ", ".join(entry["solvers"]) or "none",
    }
    paragraphs = [f"{entry['title']} ({entry['id']})", *entry["about"]]
    text = "\n\n".join(_filled(" ".join(part.split()), "") for part in paragraphs)
    return text + "\n\n" + "\n".join(_filled(words, f"{key:19}") for key, words in rows.items())


def _filled(words: str, head: str) -> str:
    return fill(
        words, WIDTH, initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False
    )


def signature_entry(found: Signature, values: Mapping[str, float]) -> dict[str, Any]:
    """A signature as JSON; values: those of the variables before the re-fit."""
    before, after = rms(found.before), rms(found.after)
    return {
        "value": found.value,
        "mass_kg": found.mass_kg,
        "before_percent": before,
        "after_percent": after,
        "absorbed": found.absorbed,
        "refitted": {
            name: {"before": values[name], "after": value} for name, value in found.refitted.items()
        },
        "rows": [
            {
                "pressure_kPa": pressure,
                "modes": [
                    {
                        "c": label.c,
                        "m": label.m,
                        "kind": label.kind,
                        "before_percent": _number(found.before[k, j]),
                        "after_percent": _number(found.after[k, j]),
                    }
                    for j, label in enumerate(found.labels)
                ],
            }
            for k, pressure in enumerate(found.pressures_kPa)
        ],
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
