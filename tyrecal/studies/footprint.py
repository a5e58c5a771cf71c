"""Footprints: contact area, length, width, pressure, deflection and stiffness at rising loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..evaluate.evaluator import Evaluator
from ..evaluate.failure import EvaluationFailed
from ..evaluate.pressed import Footprint, Pressed
from ..tyre.mesh import SectionMesh
from .patch import patch_of

USUAL = (0.8, 1.6)  # mean contact pressure of a passenger car's tyre over its inflation pressure
Outcome = Pressed | EvaluationFailed


def press(
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    jobs: int = 1,
    notify: Callable[[str, Outcome], None] = lambda design, outcome: None,
) -> dict[str, Outcome]:
    """Every design (name to values of the variables) at rising loads, or why not even at the
    first one. Raises DeckRefused and what else ``Evaluator.press`` raises for wrong input."""
    found: dict[str, Outcome] = {}
    for design, outcome in zip(
        designs, evaluator.press_all(designs.values(), loads_N, jobs), strict=True
    ):
        found[design] = outcome
        notify(design, outcome)
    return found


def progress(outcome: Outcome) -> tuple[int, EvaluationFailed | None]:
    """How many loads were reached, and why no more."""
    if isinstance(outcome, Pressed):
        return len(outcome.footprints), outcome.failed
    return 0, outcome


def footprint_result(
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    outcomes: Mapping[str, Outcome],
    meshes: Mapping[str, SectionMesh],
) -> dict[str, Any]:
    """The content of footprint.json: ``rows``, ``failed``, ``findings``, the ``designs``' values.

    outcomes: of ``press``, one of them at least with footprints; meshes: of the designs' sections.
    """
    pressed = {name: each for name, each in outcomes.items() if isinstance(each, Pressed)}
    rows = [
        {"design": name, **footprint_row(each, footprint, meshes[name])}
        for name, each in pressed.items()
        for footprint in each.footprints
    ]
    failed = []
    for name, outcome in outcomes.items():
        reached, failure = progress(outcome)
        if failure:
            failed.append(
                {
                    "design": name,
                    "load_N": loads_N[reached],
                    "cause": failure.cause,
                    "words": failure.words,
                }
            )
    pressures = {name: each.pressure_kPa for name, each in pressed.items()}
    return {
        "format": 1,
        "pressure_kPa": pressures,
        "designs": {name: dict(values) for name, values in designs.items()},
        "rows": rows,
        "failed": failed,
        "findings": findings(rows, pressures),
    }


def footprint_row(pressed: Pressed, footprint: Footprint, mesh: SectionMesh) -> dict[str, float]:
    """Numbers of one load: areas in m2, lengths in m, pressures in Pa, stiffness in N/m."""
    patch = patch_of(pressed, footprint, mesh)
    area = footprint.contact_area_m2 or float(footprint.area_m2.sum())
    return {
        "load_N": footprint.load_N,
        "deflection_m": footprint.deflection_m,
        "area_m2": area,
        "length_m": patch.length_m,
        "width_m": patch.width_m,
        "mean_pressure_Pa": footprint.road_N / area,
        "peak_pressure_Pa": float(footprint.pressure_Pa.max()),
        "vertical_stiffness_N_per_m": footprint.stiffness_N_per_m,
    }


def findings(
    rows: Sequence[Mapping[str, Any]], pressure_kPa: Mapping[str, float]
) -> dict[str, Any]:
    """What the rows say: ``fitted_over_initial`` area, where both were pressed; per design
    ``mean_over_inflation``, its mean contact pressure over its inflation pressure
    (``pressure_kPa``), each by load; ``words``: sentences."""
    area = {(row["design"], row["load_N"]): row["area_m2"] for row in rows}
    loads = [load for design, load in area if design == "fitted" and ("initial", load) in area]
    ratios = {load: area["fitted", load] / area["initial", load] for load in loads}
    words = [_larger(ratios)] if ratios else []
    means = {}
    for design, kPa in pressure_kPa.items():
        if kPa:
            own = [row for row in rows if row["design"] == design]
            means[design] = {row["load_N"]: row["mean_pressure_Pa"] / kPa / 1e3 for row in own}
            words.append(f"{design}: {_mean(means[design])}")
    return {
        "fitted_over_initial": _by_load(ratios),
        "mean_over_inflation": {design: _by_load(shares) for design, shares in means.items()},
        "words": words,
    }


def _by_load(values: Mapping[float, float]) -> list[dict[str, float]]:
    return [{"load_N": load, "ratio": value} for load, value in values.items()]


def _larger(ratios: Mapping[float, float]) -> str:
    """Where the fitted tyre has the larger area."""
    listed = ", ".join(f"{100 * (x - 1):+.1f} % at {load:g} N" for load, x in ratios.items())
    odd = [f"{load:g} N" for load, x in ratios.items() if x <= 1]
    claim = "the fitted tyre's area is larger than the initial one's at"
    if not odd:
        return f"{claim} every load: {listed}"
    if len(odd) == len(ratios):
        return f"{claim} no load: {listed}"
    return f"{claim} all loads but {', '.join(odd)}: {listed}"


def _mean(shares: Mapping[float, float]) -> str:
    """How the mean contact pressure stands to the inflation pressure."""
    low, high = USUAL
    odd = [f"{load:g} N ({x:.2f})" for load, x in shares.items() if not low <= x <= high]
    span = " to ".join(dict.fromkeys(f"{f(shares.values()):.2f}" for f in (min, max)))
    usual = f"the usual {low:g} to {high:g}"
    return f"mean contact pressure is {span} of the inflation pressure, " + (
        f"outside {usual} at {', '.join(odd)}" if odd else f"within {usual}"
    )
