"""Names for templates of what moves beside the tyre, and of rubber that follows the frequency."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...tyre.case import Case
from ...tyre.case.analysis import Analysis
from ...tyre.case.materials import Rubber
from ...tyre.case.wheel import Rim
from ...tyre.resolve import Tyre

FIRST_WHEEL_ELEMENT = 999_000_001  # beyond all that a revolve makes
LOWEST_HZ, SHIFT = 1.0, -100.0  # of a free wheel's modes: above its rigid motions; 1/s2
GAS = "CAVITY_GAS"
ATMOSPHERE = 101_325.0  # Pa
GASES = {  # specific gas constant (J/kg/K) and ratio of specific heats at 20 C
    "air": (287.05, 1.400),
    "helium": (2077.1, 1.667),
    "sulphur_hexafluoride": (56.93, 1.094),
}
TABLE_HZ = np.geomspace(1.0, 1000.0, 13)


def aside(tyre: Tyre) -> dict[str, Any]:
    """What no deck of keywords says: which surfaces hold the gas, whose frequency counts."""
    request: dict[str, Any] = {}
    if "frequency_modulus" in tyre.needs:
        request["own_frequency"] = True
    if "cavity" in tyre.needs:
        request["cavity"] = {"material": GAS, "surfaces": ["CAVITY", "WELL"]}
    if tyre.case.splice.share:
        request["sector"] = {"job": "splice", "width_deg": tyre.case.splice.width_deg}
    return request


def wheel(rim: Rim) -> dict[str, Any]:
    """The rim's point elements, which degrees of freedom stay held, and how to look for modes.

    The axle is the second axis of the revolved tyre.
    """
    s = rim.spindle
    compliances = {
        (2,): ("LATERAL", s.lateral_m_per_N),
        (1, 3): ("RADIAL", s.radial_m_per_N),
        (5,): ("TORSIONAL", s.torsional_rad_per_N_m),
        (4, 6): ("TILT", s.tilt_rad_per_N_m),
    }
    springs = [
        {"name": f"SPINDLE_{name}_{dof}", "dof": dof, "stiffness": 1 / compliance}
        for dofs, (name, compliance) in compliances.items()
        for dof in dofs
        if compliance
    ]
    numbered = [
        {**spring, "element": FIRST_WHEEL_ELEMENT + 2 + i} for i, spring in enumerate(springs)
    ]
    moving = {spring["dof"] for spring in springs}
    return {
        "mass": {"element": FIRST_WHEEL_ELEMENT, "value": rim.mass_kg},
        "inertia": {
            "element": FIRST_WHEEL_ELEMENT + 1,
            "polar": rim.polar_inertia_kg_m2,
            "diametral": rim.diametral_inertia_kg_m2,
        },
        "springs": numbered,
        "held": [] if rim.free else [dof for dof in range(1, 7) if dof not in moving],
        "search": {"lowest": LOWEST_HZ, "shift": SHIFT} if rim.free else None,
    }


def gas_material(case: Case) -> dict[str, Any] | None:
    """The share of an ideal gas: density p / (R T), adiabatic bulk modulus gamma p; p absolute."""
    cavity = case.cavity
    if not cavity.share:
        return None
    R, gamma = GASES[cavity.gas]
    p = case.pressure_kPa * 1e3 + ATMOSPHERE
    return {
        "name": GAS,
        "density": cavity.share * p / (R * (cavity.temperature_C + 273.15)),
        "bulk_modulus": cavity.share * gamma * p,
    }


def frequency_rubber(m: Rubber, analysis: Analysis) -> dict[str, Any]:
    """Constants of the inflated state as long-term ones, and the shear modulus over frequency:
    G(f)/G0 = (f / f_ref)^beta times the Prony series' at the vibration frequency."""
    shear, bulk = 1 - sum(t.g for t in m.prony), 1 - sum(t.k for t in m.prony)
    static = (1.0, 1.0)
    if m.moduli != analysis.static_moduli:
        static = (1 / shear, 1 / bulk) if m.moduli == "long_term" else (shear, bulk)
    level = 1.0
    if analysis.vibration_frequency_Hz is not None:
        squares = [(2 * np.pi * analysis.vibration_frequency_Hz * t.tau_s) ** 2 for t in m.prony]
        dynamic = shear + sum(t.g * x / (1 + x) for t, x in zip(m.prony, squares, strict=True))
        level = dynamic / (shear if analysis.static_moduli == "long_term" else 1.0)
    return {
        "kind": "rubber",
        "C10": m.C10_Pa * static[0],
        "C01": m.C01_Pa * static[0],
        "D1": m.D1_per_Pa / static[1],
        "moduli": "LONG TERM",
        "prony": [],
        "storage": [
            {
                "frequency": float(f),
                "shear": 1 - float(level * (f / m.reference_frequency_Hz) ** m.frequency_exponent),
            }
            for f in TABLE_HZ
        ],
        "density": m.density_kg_per_m3,
    }
