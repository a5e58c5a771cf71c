"""The plots of a page: fit, convergence, pressure, load, residuals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from markupsafe import Markup

from ...modes.loaded import SYMMETRIES
from ...modes.mode import FAMILIES, Label
from .contents import Fit, FootprintRow, LoadRow, PressureRow, Residual
from .results import DesignPoint
from .svg import Panel, around

FEW = 50  # design points are marked one by one
DESIGNS = ("fitted", "initial")  # in the order of colours and marks
Curve = list[tuple[float, float]]


def label(mode: Any) -> str:
    """[2,1], [0,0] lateral"""
    return Label(mode.c, mode.m, mode.kind).said


def deviations(fit: Fit) -> Markup:
    """Frequencies over their targets before (hollow) and after the fit, a line a mode."""
    pairs = [
        (label(m), 100 * (m.initial_Hz / m.target_Hz - 1), m.deviation_percent) for m in fit.modes
    ]
    x = around([0.0, *(value for _, *both in pairs for value in both)], "deviation from target, %")
    y = around([0.5, -len(pairs) + 0.5], "")
    panel = Panel("Before and after", x, y, 80 + 20 * len(pairs), 92)
    panel.upright(0.0)
    panel.rows([name for name, *_ in pairs])
    for row, (name, before, after) in enumerate(pairs):
        panel.span((before, -row), (after, -row))
        panel.mark((before, -row), 1, "s1 hollow", f"{name} initial {before:+.2f} %")
        panel.mark((after, -row), 0, "s0", f"{name} fitted {after:+.2f} %")
    return panel.svg(numbers=False)


def convergence(history: Sequence[DesignPoint], unit: str) -> list[Markup]:
    """The objective, and every variable over its start value, both logarithmic."""
    numbers = range(1, len(history) + 1)
    known = [(k, p.objective) for k, p in zip(numbers, history, strict=True) if p.objective]
    x = replace(around([1, max(2, len(history))], "design point"), whole=True)
    panels = []
    if known:
        top = Panel("Objective", x, around([o for _, o in known], unit, log=True))
        best = [(k, min(o for j, o in known if j <= k)) for k, _ in known]
        top.line(best, "line s0", step=True)
        for k, o in known if len(known) <= FEW else ():
            top.mark((k, o), 0, "s1", f"point {k}: {o:.4g} {unit}")
        for k, tried in zip(numbers, history, strict=True):
            if tried.objective is None:
                top.cross((k, top.y.high), f"point {k} could not be evaluated")
        panels.append(top)
    ratios: dict[str, Curve] = {}
    for name, start in history[0].values.items():
        ratio = [p.values[name] / start if start else math.nan for p in history]
        if all(value > 0 for value in ratio):
            ratios[name] = list(zip(map(float, numbers), ratio, strict=True))
    if ratios:
        y = around([v for curve in ratios.values() for _, v in curve], "value / start", log=True)
        bottom = Panel("Variables", x, y)
        bottom.level(1.0)
        for k, (name, curve) in enumerate(ratios.items()):
            bottom.line(curve, f"line s{k % 6}")
            for point in curve if len(curve) <= FEW else curve[-1:]:
                words = f"{name}: {point[1]:.4g} at point {point[0]:g}"
                bottom.mark(point, k, f"s{k % 6}", words)
        panels.append(bottom)
    _mark_starts(panels, history)
    return [panel.svg() for panel in panels]


def _mark_starts(panels: Iterable[Panel], history: Sequence[DesignPoint]) -> None:
    for panel in panels:
        for k in range(1, len(history)):
            if history[k].start != history[k - 1].start:
                panel.upright(k + 0.5)


def pressure(
    rows: Sequence[PressureRow], targets: Mapping[str, float], target_kPa: float
) -> list[Markup]:
    """Frequencies over the pressure, a panel a family, and their slopes d ln f / d ln p."""
    curves: dict[tuple[str, Any, str], Curve] = {}
    slopes: dict[tuple[str, Any, str], Curve] = {}
    for row in rows:
        for mode in row.modes:
            key = row.design, Label(mode.c, mode.m, mode.kind), ""
            curves.setdefault(key, []).append((row.pressure_kPa, mode.frequency_Hz))
            if mode.d_ln_f_d_ln_p is not None:
                slopes.setdefault(key, []).append((row.pressure_kPa, mode.d_ln_f_d_ln_p))
    what = "inflation pressure, kPa"
    found = _families(curves, what, "Hz", True, targets, target_kPa)
    return found + (_families(slopes, what, "d ln f / d ln p", False) if slopes else [])


def load(rows: Sequence[LoadRow]) -> list[Markup]:
    """Frequencies over the load, a panel a family and design; antisymmetric members dashed."""
    curves: dict[tuple[str, Any, str], Curve] = {}
    for row in rows:
        for mode in row.modes:
            key = row.design, Label(mode.c, mode.m, mode.kind), mode.symmetry or ""
            curves.setdefault(key, []).append((row.load_N / 1e3, mode.frequency_Hz))
    panels = []
    for design in dict.fromkeys(row.design for row in rows):
        own = {key: curve for key, curve in curves.items() if key[0] == design}
        panels += _families(own, "load, kN", "Hz", True)
    return panels


def _families(
    curves: Mapping[tuple[str, Any, str], Curve],
    across: str,
    up: str,
    zero: bool,
    targets: Mapping[str, float] | None = None,
    target_at: float = 0.0,
) -> list[Markup]:
    """A panel a family of modes: colour and mark by c, dashed and hollow the initial design or
    the antisymmetric member."""
    designs = {design for design, _, _ in curves}
    panels = []
    every = [y for curve in curves.values() for _, y in curve]
    for family in (*FAMILIES, None):
        own = {key: curve for key, curve in curves.items() if key[1].family == family}
        if not own:
            continue
        x = around([x for curve in own.values() for x, _ in curve], across)
        title = f"{family or 'across the belt'}, {' and '.join(sorted(designs, reverse=True))}"
        panel = Panel(
            title if zero else f"slopes, {family or 'across the belt'}",
            x,
            around(every, up, zero=zero),
        )
        for (design, mode, symmetry), curve in own.items():
            other = symmetry == SYMMETRIES[1] or (not symmetry and design == "initial")
            style = f"s{mode.c % 6}"
            panel.line(curve, f"line {style} {'dashed' if other else ''}")
            for point in curve:
                words = f"{mode.said} {symmetry or design}: {point[1]:.4g} at {point[0]:g}"
                panel.mark(point, mode.c, f"{style} {'hollow' if other else ''}", words)
        last = {(mode, symmetry): curve[-1][1] for (_, mode, symmetry), curve in own.items()}
        ends = {mode: y for (mode, _), y in last.items()}
        panel.names([(y, mode.said.split()[-1]) for mode, y in ends.items()])
        for mode in ends:
            if targets and mode.said in targets and x.low <= target_at <= x.high:
                value = targets[mode.said]
                panel.cross((target_at, value), f"{mode.said} target {value:g} Hz")
        panels.append(panel.svg())
    return panels


def footprint(rows: Sequence[FootprintRow]) -> list[Markup]:
    """Area, deflection, stiffness and pressures over the load, every design."""
    designs = list(dict.fromkeys(row.design for row in rows))
    panels = []
    for title, unit, per_si, key in (
        ("Contact area", "cm²", 1e4, "area_m2"),
        ("Deflection", "mm", 1e3, "deflection_m"),
        ("Vertical stiffness", "N/mm", 1e-3, "vertical_stiffness_N_per_m"),
        ("Mean contact pressure", "kPa", 1e-3, "mean_pressure_Pa"),
    ):
        values = [(row.load_N / 1e3, getattr(row, key) * per_si) for row in rows]
        x = around([0.0, *(x for x, _ in values)], "load, kN", zero=True)
        panel = Panel(title, x, around([0.0, *(y for _, y in values)], unit, zero=True))
        ends = []
        for design in designs:
            k = DESIGNS.index(design) if design in DESIGNS else len(DESIGNS)
            own = [point for row, point in zip(rows, values, strict=True) if row.design == design]
            dashed = design == "initial"
            panel.line(own, f"line s{k} {'dashed' if dashed else ''}")
            for x_, y_ in own:
                words = f"{design}: {y_:.4g} {unit} at {x_:g} kN"
                panel.mark((x_, y_), k, f"s{k} {'hollow' if dashed else ''}", words)
            ends.append((own[-1][1], design))
        panel.names(ends)
        panels.append(panel.svg())
    return panels


def residuals(found: Sequence[Residual]) -> Markup:
    """What calibration leaves of each measurement, with one standard deviation without a gap."""
    ends = [r.percent + s * r.sigma_percent for r in found for s in (-1, 1)]
    x = around([0.0, *ends], "measured over model, %")
    y = around([0.5, -len(found) + 0.5], "")
    panel = Panel("What calibration leaves", x, y, 80 + 18 * len(found), 166)
    panel.upright(0.0)
    panel.rows(
        [r.row.replace("axial", "lateral") + (f", run {r.run + 1}" if r.run else "") for r in found]
    )
    for row, r in enumerate(found):
        low, high = r.percent - r.sigma_percent, r.percent + r.sigma_percent
        panel.span((low, -row), (high, -row), "s0")
        panel.mark(
            (r.percent, -row), 0, "s0", f"{r.row}: {r.percent:+.2f} ± {r.sigma_percent:.2f} %"
        )
    return panel.svg(numbers=False)
