"""A folder with results of every study, written by hand: a ring that is its own tyre.
Under a load it has modes, their shapes on the tread, a sweep, and the footprint."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from .ring import fit, parts, pressure_sweep, provenance, shapes, sweep
from .ring_inference import diagnosis, effects, plan, sample, sensitivities

RINGS = 16


def _members(load: float) -> list[dict[str, Any]]:
    return [
        {
            "c": c,
            "m": m,
            "kind": None,
            "frequency_Hz": hertz + shift * load / 1e3,
            "multiplicity": 1,
            "symmetry": symmetry,
            "overlap": 0.98,
            "spanned": 1.0,
        }
        for c, m, hertz in ((1, 0, 60.0), (2, 0, 80.0))
        for symmetry, shift in (("symmetric", 5.0), ("antisymmetric", -1.0))
    ]


def loaded_modes() -> dict[str, Any]:
    return {
        "format": 1,
        "pressure_kPa": 240.0,
        "load_N": 1000.0,
        "mass_kg": 12.5,
        "variables": {"A_belt": 2e-7},
        "deflection_m": 0.0053,
        "modes": _members(1000.0),
        "findings": {"words": ["all is well"]},
    }


def loaded_shapes(name: str) -> dict[str, Any]:
    angles = 2 * np.pi * np.arange(RINGS) / RINGS
    place = np.zeros((RINGS, 3, 3))
    place[..., 0], place[..., 2] = 0.39, [-0.08, 0.0, 0.08]
    modes = []
    for mode in _members(1000.0):
        u = np.zeros(place.shape)
        turn = np.cos if mode["symmetry"] == "symmetric" else np.sin
        u[..., 0] = turn(mode["c"] * angles)[:, None]
        keep = {key: mode[key] for key in ("c", "m", "kind", "symmetry", "frequency_Hz")}
        modes.append({**keep, "displacement": u.tolist()})
    return {
        "format": 1,
        "case": name,
        "pressure_kPa": 240.0,
        "load_N": 1000.0,
        "angles": angles.tolist(),
        "surface_m": place.tolist(),
        "modes": modes,
    }


def load_sweep() -> dict[str, Any]:
    rows = [
        {"design": "initial", "load_N": load, "deflection_m": load * 5e-6, "modes": _members(load)}
        for load in (0.0, 1000.0)
    ]
    failed = {"design": "initial", "load_N": 9e5, "cause": "x", "words": "too much"}
    return {
        "format": 1,
        "rows": rows,
        "findings": [{"design": "initial", "words": ["it splits"]}],
        "failed": [failed],
    }


def footprint() -> dict[str, Any]:
    rows = [
        {
            "design": design,
            "load_N": load,
            "deflection_m": load * 5e-6,
            "area_m2": load * 3e-6,
            "length_m": 0.1,
            "width_m": 0.08,
            "mean_pressure_Pa": 3.3e5,
            "peak_pressure_Pa": 5e5,
            "vertical_stiffness_N_per_m": 2e5,
        }
        for design in ("initial", "fitted")
        for load in (1000.0, 4000.0)
    ]
    failed = {"design": "fitted", "load_N": 3e4, "cause": "x", "words": "rim on road"}
    words = ["the fitted tyre's area is larger"]
    return {"format": 1, "rows": rows, "findings": {"words": words}, "failed": [failed]}


def patches(name: str) -> dict[str, Any]:
    x, y = np.meshgrid(np.linspace(-80, 80, 17), np.linspace(-120, 120, 25))
    entries = []
    for design in ("initial", "fitted"):
        for load in (1000.0, 4000.0):
            size = (load / 4000) ** (1 / 3)
            p = 500 * np.sqrt(np.maximum(0, 1 - (x / 50 / size) ** 2 - (y / 80 / size) ** 2))
            turn = np.linspace(0, 2 * np.pi, 61)
            edge = size * np.column_stack([50 * np.cos(turn), 80 * np.sin(turn)])
            entries.append(
                {
                    "design": design,
                    "load_N": load,
                    "edge_mm": [edge.ravel().tolist()],
                    "across_mm": x.tolist(),
                    "along_mm": y.tolist(),
                    "pressure_kPa": p.tolist(),
                }
            )
    return {"format": 1, "case": name, "patches": entries}


def stiffness() -> dict[str, Any]:
    row = {
        "design": "initial",
        "pressure_kPa": 240.0,
        "load_N": 4000.0,
        "vertical_N_per_m": 2.1e5,
        "lateral_N_per_m": 1.1e5,
        "longitudinal_N_per_m": 3.5e5,
        "torsional_Nm_per_rad": 4800.0,
        "vertical_sliding_N_per_m": 2e5,
        "loaded_radius_m": 0.29,
        "rolling_radius_m": 0.3,
        "deflection_m": 0.02,
        "length_m": 0.13,
        "width_m": 0.14,
        "rim_stiffness": [[1e5 * (i == j) for j in range(6)] for i in range(6)],
    }
    return {"format": 1, "designs": {"initial": {}}, "rows": [row], "failed": [], "findings": []}


def response() -> dict[str, Any]:
    function = {
        "excite": "tread:0deg:radial",
        "respond": "hub:fz",
        "quantity": "force",
        "unit": "N/N",
        "at_lowest": 1.0,
        "peak_Hz": 60.0,
        "peak": 8.0,
        "real": [1.0, 2.0, -0.5],
        "imag": [0.0, -8.0, -0.1],
    }
    return {
        "format": 1,
        "design": "initial",
        "pressure_kPa": 240.0,
        "patch_mm": 20.0,
        "radius_m": 0.3,
        "harmonics": 9,
        "frequency_Hz": [0.0, 60.0, 120.0],
        "functions": [function],
        "findings": {"words": []},
    }


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
