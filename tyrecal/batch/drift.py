"""The baseline: numbers that a batch had once, and how far each may drift from them.

A JSON file of three parts: ``format``; ``tolerances``, ``STUDY/KIND`` or ``STUDY/KIND WHERE`` to
``{"relative": r, "absolute": a}``, each 0 where it is absent, of which the name that says more
wins; ``cases``, name to study to quantity to number. A number x has drifted from b when

    |x - b| > max(r |b|, a)
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import Json, read_json
from ..tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from .case import Report

# by study and first word of a name in its `Result.quantities`, which WHERE follows; of a baseline
# that is written for the first time: people edit them
DEFAULTS = {
    "fit/objective": {"relative": 1e-3, "absolute": 0.01},
    "fit/mass_kg": {"relative": 1e-3},
    "fit/variable": {"relative": 0.01},  # the valley is flat: frequencies say more
    "fit/fitted_Hz": {"relative": 1e-3},
    **{f"fit/fitted_{name}": {"relative": 0.01} for name in FOOTPRINT_QUANTITIES},
    "modes/mass_kg": {"relative": 1e-6},
    "modes/frequency_Hz": {"relative": 1e-5},
    "sweep-pressure/frequency_Hz": {"relative": 1e-3},
    "sweep/frequency_Hz": {"relative": 1e-3},
    "footprint/deflection_m": {"relative": 2e-3},
    "footprint/area_m2": {"relative": 0.01},
    "footprint/length_m": {"relative": 0.02},
    "footprint/width_m": {"relative": 0.02},
    "footprint/mean_pressure_Pa": {"relative": 0.01},
    "footprint/peak_pressure_Pa": {"relative": 0.03},
    "footprint/vertical_stiffness_N_per_m": {"relative": 0.01},
    "sensitivities/sensitivity": {"relative": 1e-3, "absolute": 1e-4},
    "frf/peak_Hz": {"relative": 1e-3},
    "frf/peak": {"relative": 0.01},
    "frf/frac": {"absolute": 0.01},
    **{
        f"stiffness/{direction}_per_{unit}": {"relative": 0.01}
        for direction, unit in (
            ("vertical_N", "m"),
            ("lateral_N", "m"),
            ("longitudinal_N", "m"),
            ("torsional_Nm", "rad"),
        )
    },
    "sample/median": {"relative": 0.05},  # chains differ by a share of their spread
    "sample/predicted_Hz": {"relative": 1e-3},
    "plan/hours": {"absolute": 1.0},
    "plan/chance": {"absolute": 0.03},
    "plan/percent": {"relative": 0.05},  # standard deviation of a variable after the plan
    "diagnose/verdict": {"absolute": 0.0},  # 1; another verdict has another name
    "diagnose/gap_p_value": {"absolute": 0.01},
    "diagnose/gap_rms_percent": {"relative": 0.01},
    "diagnose/probability": {"absolute": 0.02},
    "diagnose/calibrated": {"relative": 0.01},
}
# of quantities that are not above, as those of studies from outside
OTHER_QUANTITIES = {"relative": 1e-3}
Figures = dict[str, dict[str, dict[str, float]]]  # by case, study, quantity


def numbers_of(reports: Sequence[Report]) -> Figures:
    """Quantities that a baseline keeps of reports: those of all studies that are good."""
    kept = {
        report["name"]: {
            study: entry["quantities"]
            for study, entry in report["studies"].items()
            if entry["status"] == "good"
        }
        for report in reports
    }
    return {name: studies for name, studies in kept.items() if studies}


def baseline_of(reports: Sequence[Report], before: Json | None) -> Json:
    """A new baseline, with the tolerances of the one ``before`` (None: there was none), and of what
    that did not have."""
    cases = numbers_of(reports)
    tolerances = dict(before["tolerances"] if before else DEFAULTS)
    for studies in cases.values():
        for study, quantities in studies.items():
            for quantity in quantities:
                kind = f"{study}/{quantity.partition(' ')[0]}"
                if not _named(tolerances, study, quantity):
                    tolerances[kind] = DEFAULTS.get(kind, OTHER_QUANTITIES)
    return {"format": 1, "tolerances": tolerances, "cases": cases}


def read_baseline(path: Path) -> Json:
    """A baseline from its file. Raises InputError, in one sentence; OSError."""
    try:
        content = read_json(path)
    except ValueError as error:
        raise InputError(f"'{path}' is not a baseline: {error}") from None
    if not isinstance(content, dict) or content.get("format") != 1:
        raise InputError(f"'{path}' is not a baseline of format 1")
    tolerances, cases = content.get("tolerances"), content.get("cases")
    if not isinstance(tolerances, dict) or not isinstance(cases, dict):
        raise InputError(f"'{path}' is not a baseline: must have the keys tolerances and cases")
    for name, tolerance in tolerances.items():
        known = isinstance(tolerance, dict) and set(tolerance) <= {"relative", "absolute"}
        if not known or not all(_number(x) and x >= 0 for x in tolerance.values()):
            raise InputError(
                f"'{path}': tolerances.{name} must be {{'relative': r, 'absolute': a}} with finite"
                f" numbers of 0 or more, got {json.dumps(tolerance)}"
            )
    for case, studies in cases.items():
        for study, quantities in studies.items() if isinstance(studies, dict) else [("?", None)]:
            if not isinstance(quantities, dict) or not all(map(_number, quantities.values())):
                raise InputError(f"'{path}': cases.{case}.{study} must be names with numbers")
            for quantity in quantities:
                if not _named(tolerances, study, quantity):
                    kind = f"{study}/{quantity.partition(' ')[0]}"
                    raise InputError(f"'{path}': no tolerance '{kind}' for cases.{case}")
    return content


def compare(reports: Sequence[Report], baseline: Json) -> Json:
    """Drift of reports from a baseline: ``compared`` numbers; ``drifted``, the worst first, each
    with case, study, quantity, ``baseline``, ``value`` (None where it is gone), ``allowed``
    (absolute); ``missing_cases``, ``new_cases``; ``missing_studies``, ``new_studies`` [case/study];
    and ``new``, the number of new quantities in studies that were compared.

    A study that is not good is a failure already: it is not compared.
    """
    known: Figures = baseline["cases"]
    drifted, compared, new = [], 0, 0
    missing_studies, new_studies = [], []
    for report in reports:
        before = known.get(report["name"])
        if before is None:
            continue
        studies = {k: v for k, v in report["studies"].items() if v["status"] == "good"}
        missing_studies += [f"{report['name']}/{s}" for s in before if s not in report["studies"]]
        new_studies += [f"{report['name']}/{s}" for s in studies if s not in before]
        for study in (study for study in before if study in studies):
            now = studies[study]["quantities"]
            new += len(set(now) - set(before[study]))
            for quantity, old in before[study].items():
                compared += 1
                value = now.get(quantity)
                tolerance = baseline["tolerances"][_named(baseline["tolerances"], study, quantity)]
                allowed = max(tolerance.get("relative", 0) * abs(old), tolerance.get("absolute", 0))
                if value is None or not abs(value - old) <= allowed:
                    drifted.append(
                        {
                            "case": report["name"],
                            "study": study,
                            "quantity": quantity,
                            "baseline": old,
                            "value": value,
                            "allowed": allowed,
                        }
                    )
    names = {report["name"] for report in reports}
    return {
        "compared": compared,
        "drifted": sorted(drifted, key=_badness, reverse=True),
        "missing_cases": sorted(set(known) - names),
        "new_cases": sorted(names - set(known)),
        "missing_studies": missing_studies,
        "new_studies": new_studies,
        "new": new,
    }


def _badness(drift: Json) -> float:
    """How many times over what is allowed."""
    if drift["value"] is None:
        return float("inf")
    change = abs(drift["value"] - drift["baseline"])
    return change / drift["allowed"] if drift["allowed"] else float("inf")


def _named(tolerances: Json, study: str, quantity: str) -> str:
    """Name of the tolerance of a quantity, empty where there is none."""
    names = (f"{study}/{quantity}", f"{study}/{quantity.partition(' ')[0]}")
    return next((name for name in names if name in tolerances), "")


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
