"""Inference about the ring: a sample, effects on it, and a diagnosis."""

from __future__ import annotations

from typing import Any

import numpy as np

from .ring import provenance


def sensitivities() -> dict[str, Any]:
    values = {"C10": (0.5, 0.25), "rebar_layers.belt.angle_deg": (-0.01, 0.02)}
    quantities = {"frequency_Hz [2,0]": 79.5, "mass_kg": 12.5}
    return {
        "format": 1,
        "design": "fitted",
        "number_values": {"C10": 8e5, "rebar_layers.belt.angle_deg": 70.0},
        "quantity_values": quantities,
        "rows": [
            {"quantity": q, "by": by, "value": x, "per": "degree" * by.endswith("deg")}
            for by, row in values.items()
            for q, x in zip(quantities, row, strict=True)
        ],
        "selection": {
            "chi2": 40.5,
            "chi2_left": 9.5,
            "chi2_exact_section": 90.5,
            "freedom": 11,
            "known_from": "drawing",
            "steps": [
                {
                    "name": "belt_angle",
                    "sets": ["rebar_layers.belt.angle_deg"],
                    "gain": 31.0,
                    "p_value": 5e-5,
                    "shift_in_sd": 2.75,
                    "alike": ["gauge"],
                }
            ],
            "next_name": "gauge",
            "next_p_value": 0.625,
            "numbers": [
                {"name": "belt_angle", "sets": ["rebar_layers.belt.angle_deg"], "shift_in_sd": 2.5},
                {"name": "gauge", "sets": ["section.gauges.0.factor"], "shift_in_sd": 0.375},
            ],
        },
    }


def sample() -> dict[str, Any]:
    """Sample of two variables with bell-shaped, turned counts."""
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
        "variance_shares": [
            {
                **{key: row[key] for key in ("c", "m", "kind", "frequency_Hz")},
                "deviation_percent": 4.2,
                "first": {"A_belt": 0.7, "angle": 0.2},
                "total": {"A_belt": 0.8, "angle": 0.3},
            }
        ],
        "optima": [{"values": {"A_belt": 3.1e-7, "angle": 3.1e-7}, "below": 0.0}],
        "uncertain": ["pressure 1 kPa"],
    }


def effects(name: str) -> list[dict[str, Any]]:
    """Effects: one with a new fit, one whose mode is lost at the middle pressure."""
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


def plan() -> dict[str, Any]:
    step = {"hours": 1.0, "chance": 0.25, "predicted_percent": 0.27}
    effect = {"unit": "m", "base": 0.0, "largest_lambda": 91.0, "similar": ["bead_seat"]}
    sizes = {"detectable_from": 0.004, "named_from": None}
    return {
        "format": 1,
        "noise_percent": 0.2,
        "step_hours": {"mount": 2.0, "frf_set": 0.75},
        "steps": [
            {"what": "response functions at 160 kPa", "total_hours": 1.0, **step},
            {"what": "response functions at 240 kPa", "total_hours": 2.0, **step},
        ],
        "effects": [{"id": "rim_width", "chance": [0.25, 0.5], **effect, **sizes}],
        "false_alarm": 0.01,
        "draws": 100,
        "variables": [{"name": "C10", "before_percent": 50.0, "after_percent": 0.5}],
        "modes": [
            {
                "c": 2,
                "m": 0,
                "kind": None,
                "frequency_Hz": 79.5,
                "before_percent": 9.5,
                "after_percent": 0.2,
            }
        ],
        "sensors": [{"sensor": 1, "radius_m": 0.3, "angle_deg": 7.5, "z_m": 0.05}],
        "axes": "rtz",
        "not_labelled": ["[4,0]"],
    }
