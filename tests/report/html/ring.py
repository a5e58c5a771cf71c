"""A ring that is its own tyre: what it is, its fit, its mode shapes, and its pressure sweep."""

from __future__ import annotations

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
POINTS = 13
Array = np.ndarray


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
                "unit": "m2",
            },
            "C10": {
                "initial": 1e6,
                "value": 8e5,
                "lower": 8e5,
                "upper": 1e7,
                "standard_error": None,
                "at_bound": True,
                "unit": "Pa",
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
        "fixed_units": {"angle": "degrees"},
        "noise_Hz": 1.5,
        "responses": [
            {
                "c": 2,
                "m": 0,
                "kind": None,
                "pressure_kPa": 240.0,
                "scatter": 0.01,
                "response": {"A_belt": 1.25, "C10": -0.5},
            }
        ],
        "correlations": {
            "A_belt": {"A_belt": 1.0, "C10": -0.25},
            "C10": {"A_belt": -0.25, "C10": 1.0},
        },
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


def sweep() -> dict[str, Any]:
    mode = {"c": 2, "m": 0, "kind": None}
    points = [
        {
            "values": {"C10": 1e6 * share, "pressure_kPa": 240.0},
            "mass_kg": 12.8,
            "modes": [{**mode, "frequency_Hz": 79.5 * share, "multiplicity": 2}],
        }
        for share in (0.9, 1.0)
    ]
    return {
        "format": 1,
        "design": "initial",
        "sampling": "grid",
        "numbers_swept": [
            {"name": "C10", "low": 9e5, "high": 1e6, "steps": 2},
            {"name": "pressure_kPa", "low": 240.0, "high": 300.0, "steps": 2},
        ],
        "rows": points,
        "failed": [],
        "modes": [
            {
                **mode,
                "frequency_Hz": 75.5,
                "lowest_Hz": 71.55,
                "highest_Hz": 79.5,
                "change_percent": {"C10": 10.5, "pressure_kPa": 0.0},
                "linear_share": 1.0,
            }
        ],
        "findings": {"words": ["a grid of 4 points"]},
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
