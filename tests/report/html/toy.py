"""A folder with results of every study, written by hand: a ring that is its own tyre."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from .ring import fit, parts, pressure_sweep, provenance, shapes, sweep
from .ring_inference import diagnosis, effects, plan, sample, sensitivities
from .ring_under_load import (
    footprint,
    load_sweep,
    loaded_modes,
    loaded_shapes,
    patches,
    response,
    stiffness,
)


def write(folder: Path, name: str = "Toy & sons", effect: str = "rim_width") -> Path:
    """Write the folder; ``name`` of the case and ``effect`` may be as hostile as one likes."""
    folder.mkdir(parents=True, exist_ok=True)
    files: dict[str, Any] = {
        "run.json": {
            "fit": {
                "case": "/somewhere/toy.yaml",
                "tyrecal": "0.1.0",
                "solver": "ring 1.0",
                "started": "2026-01-01T00:00:00+00:00",
                "seconds": 1.5,
                "host": "here",
                "arguments": ["fit", "my cases/toy.yaml"],
            }
        },
        "fit.json": fit(),
        "fit_shapes.json": shapes(name),
        "modes.json": loaded_modes(),
        "modes_shapes.json": loaded_shapes(name),
        "pressure_sweep.json": pressure_sweep(),
        "load_sweep.json": load_sweep(),
        "sweep.json": sweep(),
        "footprint.json": footprint(),
        "footprint_patches.json": patches(name),
        "stiffness.json": stiffness(),
        "frf.json": response(),
        "sensitivities.json": sensitivities(),
        "effects.json": effects(name),
        "sample.json": sample(),
        "plan.json": plan(),
        "diagnosis.json": diagnosis(effect),
        "diagnosis_section.json": {"format": 1, "case": name, **parts()},
    }
    for file in ("fit.json", "modes.json", "diagnosis.json"):
        files[file]["provenance"] = provenance(name)
    for file, content in files.items():
        (folder / file).write_text(json.dumps(content))
    (folder / "fit_history.csv").write_text(
        "point,start,A_belt,C10,objective_Hz,failure\n"
        "1,1,2e-07,1000000.0,33.13,\n2,1,3e-07,900000.0,,no equilibrium\n"
        "3,1,3.6e-07,800000.0,8.6,\n"
    )
    (folder / "diagnosis.md").write_text(
        f"# What the model of {name} lacks\n\n"
        f"## Named: {effect}\n\n`{effect}` explains the gap.\n\n"
        "## Which effect?\n\n| explanation | probability | size |\n|---|---|---|\n"
        "| Rim width | 0.71 | -0.009 m |\n| none | 0.02 |  |\n\n"
        "## What to measure next\n\n1. weigh the tyre\n2. <b>measure</b> again\n"
    )
    return folder
