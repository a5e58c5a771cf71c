"""A folder with results of every study, written by hand: a ring that is its own tyre."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

# c, m, kind, initial, optimised, target: Table 2 of Bekakos et al. 2016
TABLE_2 = [
    (0, 0, "axial", 36.85, 30.86, 31.7),
    (0, 0, "torsional", 37.17, 35.85, 35.0),
    (1, 1, None, 43.85, 36.92, 37.8),
    (2, 0, None, 90.57, 79.42, 79.5),
    (3, 1, None, 117.07, 107.9, 102.7),
]
POINTS, RINGS = 13, 16
Array = np.ndarray


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
            }
        },
        "fit.json": fit(),
        "fit_shapes.json": shapes(name),
        "modes.json": loaded_modes(),
        "modes_shapes.json": loaded_shapes(name),
        "pressure_sweep.json": pressure_sweep(),
        "load_sweep.json": load_sweep(),
        "footprint.json": footprint(),
        "footprint_patches.json": patches(name),
        "effects.json": effects(name),
        "sample.json": sample(),
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


def provenance(name: str) -> dict[str, Any]:
    return {
        "tyrecal": "0.1.0",
        "solver": "ring",
        "solver_version": "1.0",
        "name": name,
        "size": "toy",
        "tyre_sha256": "0123456789abcdef" * 4,
        "overrides": {"rim.mass_kg": 12.5},
        "mesh": "coarse",
        "state": {"pressure_kPa": 200.0, "load_N": [1e3, 4e3], "rim": "fixed"},
        "targets": "a drum, as measured in 1888 and printed in a book since",
        "measured_sha256": "fedcba9876543210" * 4,
    }


def fit() -> dict[str, Any]:
    return {
        "format": 1,
        "method": "slsqp",
        "pressure_kPa": 240.0,
        "mass_kg": 12.5,
        "objective_Hz": 8.603,
        "initial_objective_Hz": 33.135,
        "objective_unit": "Hz",
        "evaluations": 9,
        "failed_evaluations": 1,
        "converged": True,
        "moved": True,
        "message": "converged",
        "projected_gradient_norm": 1e-3,
        "label_margin": 0.9,
        "variables": {
            "A_belt": {
                "initial": 2e-7,
                "value": 3.6e-7,
                "lower": 1e-7,
                "upper": 1e-5,
                "standard_error": 3.6e-8,
                "at_bound": False,
            },
            "C10": {
                "initial": 1e6,
                "value": 8e5,
                "lower": 8e5,
                "upper": 1e7,
                "standard_error": None,
                "at_bound": True,
            },
        },
        "fixed": {"angle": 70.0},
        "modes": [
            {
                "c": c,
                "m": m,
                "kind": kind,
                "frequency_Hz": fitted,
                "multiplicity": 2 if c else 1,
                "initial_Hz": initial,
                "fitted_Hz": fitted,
                "target_Hz": target,
                "deviation_percent": 100 * (fitted / target - 1),
            }
            for c, m, kind, initial, fitted, target in TABLE_2
        ],
        "footprint": [
            {
                "quantity": "contact_area_m2",
                "load_N": 4000.0,
                "initial": 0.012,
                "fitted": 0.013,
                "target": 0.0135,
                "sigma": 2e-4,
                "deviation_percent": -3.7,
            }
        ],
        "correlations": {"A_belt": {"A_belt": 1.0}},
        "singular_values": [30.0, 5.0],
        "starts": [{}],
    }


def circle() -> tuple[Array, Array]:
    """R, Z of the outer surface from bead to bead, m."""
    angle = np.linspace(-2.4, 2.4, POINTS)
    return 0.3 + 0.09 * np.cos(angle), 0.11 * np.sin(angle)


def amplitude(c: int, m: int, kind: str | None) -> Array:
    """(points, 3) complex: in-plane inextensible, out-of-plane, or rigid."""
    R, _ = circle()
    share = (R - R.min()) / np.ptp(R)
    u = np.zeros((POINTS, 3), complex)
    if kind == "torsional":
        u[:, 1] = share
    elif kind == "axial" or m == 1:
        u[:, 2] = share
    else:
        u[:, 0], u[:, 1] = share, 1j * share / c
    return u


def shapes(name: str) -> dict[str, Any]:
    R, Z = circle()
    modes = []
    for c, m, kind, _, hertz, _ in TABLE_2:
        u = amplitude(c, m, kind)
        modes.append(
            {
                "c": c,
                "m": m,
                "kind": kind,
                "frequency_Hz": hertz,
                "n": c,
                "real": u.real.tolist(),
                "imaginary": u.imag.tolist(),
            }
        )
    flat = np.stack([1e3 * Z, 1e3 * R], 1).ravel().tolist()
    return {
        "format": 1,
        "case": name,
        "pressure_kPa": 240.0,
        "variables": {"A_belt": ["rebar_layers.belt_1.area_m2"], "C10": ["rubber.C10_Pa"]},
        "section": {
            "areas": parts()["areas"],
            "cords": {"carcass": {"angle_deg": 0.0, "lines": [flat[:10]]}},
            "rim": parts()["areas"]["crown"][:1],
            "outline": flat,
            "inflated": flat,
        },
        "R_m": R.tolist(),
        "Z_m": Z.tolist(),
        "modes": modes,
    }


def parts() -> dict[str, Any]:
    cells = [[x, 300.0, x + 9, 300.0, x + 9, 310.0, x, 310.0] for x in range(-45, 45, 9)]
    return {
        "areas": {"crown": cells[3:7], "upper sidewall": cells[:3] + cells[7:]},
        "cords": {"belt cords": [[-20.0, 305.0, 20.0, 305.0]]},
    }


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


def pressure_sweep() -> dict[str, Any]:
    rows = [
        {
            "design": design,
            "pressure_kPa": p,
            "modes": [
                {
                    "c": c,
                    "m": m,
                    "kind": kind,
                    "frequency_Hz": f * (p / 240) ** 0.4,
                    "multiplicity": 1,
                    "clarity": 1.0,
                    "d_ln_f_d_ln_p": 0.4,
                }
                for c, m, kind, initial, fitted, _ in TABLE_2
                for f in [initial if design == "initial" else fitted]
            ],
        }
        for design in ("initial", "fitted")
        for p in (160.0, 240.0, 320.0)
    ]
    return {
        "format": 1,
        "rows": rows,
        "findings": [
            {"design": "initial", "words": ["every mode rises"]},
            {"design": "fitted", "words": ["every mode rises", "every curve is concave"]},
        ],
        "failed": [
            {
                "design": "fitted",
                "pressure_kPa": 10.0,
                "cause": "no_equilibrium",
                "words": "it buckles",
            }
        ],
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
    found = []
    for design in ("initial", "fitted"):
        for load in (1000.0, 4000.0):
            size = (load / 4000) ** (1 / 3)
            p = 500 * np.sqrt(np.maximum(0, 1 - (x / 50 / size) ** 2 - (y / 80 / size) ** 2))
            found.append(
                {
                    "design": design,
                    "load_N": load,
                    "across_mm": x.tolist(),
                    "along_mm": y.tolist(),
                    "pressure_kPa": p.tolist(),
                }
            )
    return {"format": 1, "case": name, "patches": found}


def sample() -> dict[str, Any]:
    """Two variables; counts of a bell, turned."""
    at = np.linspace(-3, 3, 30)
    bell = np.exp(-0.5 * (at[:, None] ** 2 + at**2 - 0.8 * at * at[:, None]))
    share = np.exp(-0.5 * np.linspace(-3, 3, 40) ** 2)
    variable = {
        "mean": 3e-7,
        "median": 3e-7,
        "low": 2.2e-7,
        "high": 4e-7,
        "standard_error": 5e-8,
        "best": 3.1e-7,
        "lower": 1e-7,
        "upper": 1e-5,
        "density": (share / share.sum()).tolist(),
        "box": [1.5e-7, 6e-7],
        "log": True,
        "unit": "m2",
    }
    linear = {**variable, "log": False, "unit": "", "box": [1e-7, 5e-7]}
    row = {"c": 2, "m": 0, "kind": None, "frequency_Hz": 79.0, "low": 78.5, "high": 79.5}
    return {
        "format": 1,
        "seed": 0,
        "variables": {"A_belt": variable, "angle": linear},
        "correlations": {"A_belt": {"A_belt": 1.0, "angle": 0.4}, "angle": {"A_belt": 0.4}},
        "predicted": [
            {**row, "pressure_kPa": p, "mean": 79.0, "standard_error": 0.3, "measured_Hz": measured}
            for p, measured in ((240.0, 79.5), (200.0, None))
        ],
        "emulator": {
            "evaluations": 40,
            "failed": 0,
            "degree": 4,
            "median_error": 1e-7,
            "stated_error": 1e-4,
            "share_of_sigma": 0.01,
            "boxes": 1,
            "evaluations_of_all": 40,
        },
        "chains": {
            "draws": 95000,
            "kept": 19000,
            "walkers": 100,
            "steps": 950,
            "dropped": 50,
            "acceptance": 0.3,
            "autocorrelation": {"A_belt": 10.0, "angle": 9.5},
            "effective": 9500.0,
            "enough": True,
            "at_edge": 0.004,
            "stopped": "the tyre would burst",
        },
        "pairs": [{"a": "angle", "b": "A_belt", "counts": (100 * bell).astype(int).tolist()}],
        "optima": [{"values": {"A_belt": 3.1e-7, "angle": 3.1e-7}, "below": 0.0}],
        "uncertain": ["pressure 1 kPa"],
    }


def effects(name: str) -> list[dict[str, Any]]:
    """One with a re-fit, one whose mode is lost at the middle pressure."""
    both = []
    for title, after, lost in (("Filler of " + name, 1.5, False), ("Heat", None, True)):
        rows = [
            {
                "pressure_kPa": p,
                "modes": [
                    {
                        "c": 0,
                        "m": 0,
                        "kind": "axial",
                        "before_percent": p / 40,
                        "after_percent": after,
                    },
                    {
                        "c": 2,
                        "m": 1,
                        "kind": None,
                        "after_percent": after,
                        "before_percent": None if lost and p == 200 else -p / 80,
                    },
                ],
            }
            for p in (160.0, 200.0, 240.0)
        ]
        both.append(
            {
                "id": title.split()[0].lower(),
                "title": title,
                "symbol": "e",
                "unit": "K",
                "low": 0.0,
                "high": 3.0,
                "about": ["What it is."],
                "changes": ["*ELASTIC"],
                "signature": "all modes rise",
                "toggle": "cool it",
                "aliases": [],
                "solvers": ["bundled"],
                "mass_kg": 0.1,
                "refitted": {"C10": {"before": 1e6, "after": 1.1e6}},
                "value": 3.0,
                "rows": rows,
                "before_percent": 4.5,
                "after_percent": after,
                "provenance": provenance(name),
                "absorbed": None if lost else 0.886,
            }
        )
    return both


def diagnosis(effect: str) -> dict[str, Any]:
    part = {
        "stiffness_percent": 9.0,
        "stiffness_sigma": 20.0,
        "mass_percent": 21.0,
        "mass_sigma": 8.0,
        "same_as": ["belt cords"],
    }
    return {
        "format": 1,
        "verdict": "named",
        "words": f"{effect} explains the gap",
        "effect": effect,
        "parameter": {
            "effect": effect,
            "value": -0.009,
            "low": -0.012,
            "high": -0.005,
            "unit": "m",
        },
        "probabilities": {effect: 0.71, "road_contact": 0.2, "none": 0.02, "outside": 0.001},
        "candidate_set": [effect],
        "groups": [[effect, "spindle_tilt"]],
        "detectability": {effect: 12.0},
        "gap": {
            "p_value": 0.003,
            "chi2": 19.7,
            "freedom": 6,
            "rms_percent": 2.3,
            "residuals": [
                {"row": "[0,0] axial at 240 kPa", "run": 0, "percent": -4.9, "sigma_percent": 1.6},
                {"row": "[2,0] at 240 kPa", "run": 1, "percent": 0.1, "sigma_percent": 0.7},
            ],
        },
        "section_map": [
            {"region": "upper sidewall", "evidence": 3.1, **part},
            {"region": "belt cords", "evidence": -0.2, **part},
        ],
        "effective_rank": 1,
        "shrinkage": {
            "held_out": "the highest harmonics",
            "effect": effect,
            "before_percent": 2.27,
            "after_percent": 1.36,
            "fraction": 0.4,
            "low": -0.17,
            "high": 0.73,
            "placebo_95": 0.54,
            "floor_percent": 0.46,
            "before_sigma": 2.1,
            "after_sigma": 1.2,
            "least_squares_before_percent": 1.9,
            "least_squares_after_percent": 1.3,
        },
        "rung": 1,
        "next_measurements": [{"what": "weigh the tyre", "gain": 2.4, "hours": 0.25}],
    }
