"""By how much less or more sound tyres' frequencies rise over the run of pressures than the ruler's
model has it at their own numbers: what other laws, and another section, do to modes alike.

Of every tyre, of those with effects what its maker has of it without them; no noise.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import log
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.answer import case_of
from tyrecal.studies.blind.protocol import open_truth
from tyrecal.studies.blind.ruler import Ruler, read_ruler
from tyrecal.studies.inference.uncertainties import sources

from .cases import Group, with_exact_section

Array = np.ndarray


def rises(folder: Path, sealed: Path) -> dict[Label, Array]:
    """ln f at the highest pressure less ln f at the lowest, above the model's (tyres,), by mode.
    Raises InputError."""
    content, case = open_truth(folder, sealed), case_of(folder)
    ruler = read_ruler(folder)
    names = [source.name for source in sources(with_exact_section(case))[0]]
    each = [risen(ruler, names, truth) for truth in content["trials"]]
    return {label: np.array([by_label[label] for by_label in each]) for label in each[0]}


def risen(ruler: Ruler, names: Iterable[str], truth: Mapping[str, Any]) -> dict[Label, float]:
    """Rise of each mode of one tyre with pressure beyond the model's, in ln f. names: those of the
    ruler's constants, except the section's, which come after them."""
    every = np.arange(len(ruler.rows))
    x = np.array([log(value) for value in truth["variables"].values()])
    constants = np.array([truth["constants"].get(name, 0.0) for name in names])
    eta = ruler.plain(x - ruler.x0, every)[0] + ruler.constants[:, : len(constants)] @ constants
    model = dict(zip(ruler.rows, eta.tolist(), strict=True))
    table = sorted(truth["without"], key=lambda entry: entry["pressure_kPa"])
    low, high = table[0], table[-1]
    ends = [(entry["pressure_kPa"], entry["ln_f"]) for entry in (low, high)]
    above = lambda label, p, ln_f: float(np.mean(ln_f[str(label)])) - model[label, p]
    return {
        label: above(label, *ends[1]) - above(label, *ends[0])
        for label in dict.fromkeys(label for label, _ in ruler.rows)
        if label
    }


def table_of_rises(by_group: Mapping[Group, Mapping[Label, Array]]) -> str:
    """Medians, per cent, and in parentheses half of what the middle 68 % of the tyres span."""
    labels = list(next(iter(by_group.values())))
    lines = [
        f"| group | tyres | {' | '.join(map(str, labels))} |",
        "|---" * (2 + len(labels)) + "|",
    ]
    for group, modes in by_group.items():
        cells = []
        for label in labels:
            low, middle, high = 100 * np.percentile(modes[label], (16, 50, 84))
            cells.append(f"{middle:+.2f} ({(high - low) / 2:.2f})")
        lines.append(f"| {group.name} | {len(modes[labels[0]])} | {' | '.join(cells)} |")
    return "\n".join(lines)
