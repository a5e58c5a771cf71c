"""A section from a size code and a few gauges; what the code leaves open has usual values.

It is an equivalent section: a smooth tread of the rubber's mean thickness, one rubber, the carcass
in equilibrium, no bead wire. Gauges are estimates, which grow with the nominal width S1; with
them the published 205/60R15 has its mass. Measure yours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from .gauge_table import GaugeTable
from .meridian import meridian
from .section import SectionError
from .size import TyreSize

STATIONS = {"crown": 16, "shoulder": 4, "upper_sidewall": 16, "lower_sidewall": 16, "bead": 4}
"""Intervals between stations by region; the shoulder lies between the two belts' edges."""
LINE_NAMES = ("inner", "ply", "belt1", "belt2", "outer")
WIDEST = 0.53  # of the section height: where a radial tyre is widest
CROWN_RADIUS = 1.5  # of the carcass, times the section width over the aspect ratio
SHOULDER = 0.85  # gauge at the wider belt's edge over the crown's
BUTTRESS = 0.55  # of the arc from the belt to the widest point, where the sidewall's gauge begins


@dataclass(frozen=True)
class Gauges:
    """Thicknesses and widths, m. crown: inner surface to the tread's, the grooves' volume spread
    over it; sidewall: at the widest point, bead: at the rim's flange, both over all; belt: width
    of the wider belt along the carcass, the other is ``step`` narrower; rim: width between the
    flanges; liner: inner surface to carcass; ply, belts: carcass to first belt, first to second."""

    crown: float
    sidewall: float
    bead: float
    belt: float
    rim: float
    liner: float
    ply: float
    belts: float
    step: float


def usual(size: TyreSize, rim: float | None = None) -> Gauges:
    """Usual gauges of a size, on its measuring rim or one of another width, m."""
    aspect = size.section_height / size.width
    belt = min(max(0.75 + 0.5 * (0.65 - aspect), 0.75), 0.90) * size.width
    rim = size.measuring_rim if rim is None else rim
    if size.light_truck:
        return Gauges(
            crown=9.5e-3 + 0.03 * size.width,
            sidewall=4.5e-3 + 0.015 * size.width,
            bead=11e-3 + 0.02 * size.width,
            belt=belt,
            rim=rim,
            liner=1.8e-3,
            ply=1.6e-3,
            belts=1.5e-3,
            step=0.015,
        )
    return Gauges(
        crown=7e-3 + 0.03 * size.width,
        sidewall=3e-3 + 0.01 * size.width,
        bead=8e-3 + 0.02 * size.width,
        belt=belt,
        rim=rim,
        liner=1.2e-3,
        ply=1.2e-3,
        belts=1.2e-3,
        step=0.010,
    )


def build(size: TyreSize, gauges: Gauges) -> GaugeTable:
    """The half section of a size. Raises SectionError, one sentence, where there is none."""
    g = gauges
    _check(size, g)
    width, half_belt = size.section_width(g.rim), g.belt / 2
    seat, flange = size.bead_seat_radius, size.flange_radius(g.rim)
    inside_bead = max(0.2 * g.bead, g.liner)
    radius = size.rim_code * 0.0254 / 2 + WIDEST * size.section_height
    line = meridian(
        crown=size.overall_diameter / 2 - g.crown + g.liner,
        crown_radius=CROWN_RADIUS * width**2 / size.section_height,
        belt=half_belt,
        widest=(radius, width / 2 - (g.sidewall - g.liner)),
        rim=(flange, g.rim / 2),
        seat=seat + 2e-3,
        offset=g.bead - inside_bead,
    )
    ends = [0.0, half_belt - g.step / 2, half_belt, line.widest, line.rim, line.end]
    arc, labels = [0.0], ["crown"]
    for (name, count), a, b in zip(STATIONS.items(), ends, ends[1:], strict=False):
        arc += list(a + (b - a) * np.arange(1, count + 1) / count)
        labels += [name] * count
    labels[-STATIONS["bead"] - 1] = "bead"  # the rim holds the station that the two share
    s = np.array(arc)
    buttress = half_belt + BUTTRESS * (line.widest - half_belt)
    total = PchipInterpolator(
        [0, half_belt / 2, half_belt, buttress, line.widest, line.rim, line.end],
        [g.crown, g.crown, SHOULDER * g.crown, g.sidewall, g.sidewall, g.bead, g.bead],
    )(s)
    inside = PchipInterpolator(
        [0, line.widest, line.rim, line.end], [g.liner, g.liner, inside_bead, inside_bead]
    )(s)
    tiny = 1e-9
    rows = np.stack(
        [
            -inside,
            np.zeros_like(s),
            np.where(s <= half_belt + tiny, g.ply, np.nan),
            np.where(s <= half_belt - g.step / 2 + tiny, g.ply + g.belts, np.nan),
            total - inside,
        ]
    )
    table = GaugeTable(LINE_NAMES, "ply", line.at(s), rows, labels, s >= line.rim - tiny)
    outside = table.section().points[-1, :, 1]
    at = s[np.argmax(outside)]
    if outside.max() > width / 2 + 1e-5:
        what = "the belt is" if at < line.widest else "the rim is"
        raise SectionError(
            f"{size.text}: {what} too wide for a section {1e3 * width:.1f} mm wide, the tyre would"
            f" bulge beyond it at {1e3 * at:.0f} mm along the carcass"
        )
    return table


def _check(size: TyreSize, g: Gauges) -> None:
    """Gauges that no tyre has, in words."""
    width = size.section_width(g.rim)
    least = g.liner + g.ply + g.belts + 1e-3
    for name, value, low, high in (
        ("rim width", g.rim, 0.5 * size.width, 1.1 * size.width),
        ("crown", g.crown, least / SHOULDER, 0.25 * size.section_height),
        ("sidewall", g.sidewall, g.liner + 1e-3, 0.15 * width),
        ("bead", g.bead, g.liner + 2e-3, 0.2 * g.rim),
        ("belt width", g.belt, 0.4 * width, 0.95 * width),
    ):
        if not low <= value <= high:
            raise SectionError(
                f"{size.text}: the {name} must be between {1e3 * low:.1f} and {1e3 * high:.1f} mm,"
                f" got {1e3 * value:.4g}"
            )
