"""A section from a size code and a few gauges; what the code leaves open has usual values.

The tread is smooth, of its rubber's mean thickness, the carcass in equilibrium. It is turned up
round the bead: from the rim on it runs on both sides of the filler. Gauges are estimates, which
grow with the nominal width S1; with them tyres have their usual mass. Measure yours.

``tyrecal init`` writes the section as its carcass and gauges (`GaugeTable`), which an engineer
edits.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from .construction import BASE, CAP, LIGHT_TRUCK, PASSENGER, TRUCK, TURN_UP, Construction
from .meridian import Meridian, meridian
from .section import GAUGE, Section, SectionError, from_gauges, regions_of
from .size import TyreSize

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class GaugeTable:
    """Half a section, by the gauges from one of its lines."""

    names: tuple[str, ...]  # of the lines, from the inner surface to the outer
    line: str  # the one that has points
    points: Array  # (station, 2), m
    # (line, station): distances from it, inwards negative, NaN where a line is absent, m
    gauges: Array
    labels: list[str]  # each station's region
    rigid: Array  # (station,) whether the rim holds it

    def csv(self) -> str:
        """The station table, in mm to the hundredth of a micrometre."""
        file = io.StringIO(newline="")
        write = csv.writer(file, lineterminator="\n").writerow
        header, columns = ["region"], []
        for name, gauge in zip(self.names, self.gauges, strict=True):
            own = name == self.line
            header += [f"{name}_r_mm", f"{name}_z_mm"] if own else [name + GAUGE]
            columns += list(self.points.T) if own else [abs(gauge)]
        write(["station", *header, "rigid"])
        for i, label in enumerate(self.labels):
            words = ["" if np.isnan(x[i]) else f"{1e3 * x[i]:.5f}" for x in columns]
            write([i, label, *words, int(self.rigid[i])])
        return file.getvalue()

    def section(self) -> Section:
        """The same as ``read_section`` makes of ``csv``, but for its rounding."""
        return Section(
            self.names,
            from_gauges(self.points, self.gauges),
            regions_of(self.labels, list(self.rigid)),
            self.rigid,
        )


BELTED = {"crown": 16, "belt_edges": 4, "shoulder": 4}
BELOW = {"upper_sidewall": 16, "lower_sidewall": 10, "filler": 8, "bead": 4}
"""Intervals between stations by region. Those under the belts end where lines do: at two widths
these are the crown and the shoulder, with a third one ``belt_edges`` is between."""
# estimates of what radial tyres usually have
WIDEST = 0.53  # of the section height: where a radial tyre is widest
CROWN_RADIUS = 1.5  # of the carcass, times the section width over the aspect ratio
SHOULDER = 0.85  # gauge at the wider belt's edge over the crown's
BUTTRESS = 0.55  # of the arc from the belt to the widest point, where the sidewall's gauge begins
STRIP = 0.4  # of what lies outside the carcass at the rim: the rim strip outside the turn-up
NANOMETRE = 1e-9  # m, of round-off in arc lengths


@dataclass(frozen=True)
class Gauges:
    """Thicknesses and widths, m."""

    crown: float  # inner surface to the tread's, the grooves' volume spread over it
    sidewall: float  # at the widest point, over all
    bead: float  # at the rim's flange, over all
    belt: float  # width of the widest belt along the carcass
    rim: float  # width between the flanges
    liner: float  # inner surface to carcass
    ply: float  # carcass to first belt, or to its turn-up above the filler
    belts: float  # from each belt to the next
    step: float  # by which other belts are narrower than the widest, in width
    cap: float  # last belt to cap ply
    under_tread: float  # last layer to the tread


def construction(size: TyreSize) -> Construction:
    """Construction of a tyre of this size."""
    return TRUCK if size.truck else LIGHT_TRUCK if size.light_truck else PASSENGER


def usual(size: TyreSize, rim: float | None = None) -> Gauges:
    """Usual gauges of a size, on its measuring rim or one of another width, m."""
    made = construction(size)
    aspect = size.section_height / size.width  # the lower, the wider the belt over the width
    grown = {
        name: a + b * size.width
        for name, (a, b) in (
            ("crown", made.crown),
            ("sidewall", made.sidewall),
            ("bead", made.bead),
        )
    }
    return Gauges(
        **grown,
        belt=min(max(0.75 + 0.5 * (0.65 - aspect), 0.75), 0.90) * size.width,
        rim=size.measuring_rim if rim is None else rim,
        liner=made.liner,
        ply=made.ply,
        belts=made.belt,
        step=made.step,
        cap=made.cap_gauge,
        under_tread=made.under_tread,
    )


def build(size: TyreSize, gauges: Gauges) -> GaugeTable:
    """The half section of a size; s is the arc along the carcass from the crown, m. Raises
    SectionError, one sentence, where there is none."""
    g, made = gauges, construction(size)
    layers = _layers(g, made)
    _check(size, g, max(depth for depth, _ in layers.values()))
    width, half_belt = size.section_width(g.rim), g.belt / 2
    seat, flange = size.bead_seat_radius, size.flange_radius(g.rim)
    inside_bead = max(0.2 * g.bead, g.liner)  # inner surface to carcass at the rim
    radius = size.rim_code * 0.0254 / 2 + WIDEST * size.section_height
    line = meridian(
        crown=size.overall_diameter / 2 - g.crown + g.liner,
        crown_radius=CROWN_RADIUS * width**2 / size.section_height,
        belt=half_belt,
        widest=(radius, width / 2 - (g.sidewall - g.liner)),
        rim=(flange, g.rim / 2),
        # the carcass ends 2 mm above the seat; one of 5 degrees counts as flat, of 15 degrees not
        seat=seat + 2e-3 - np.tan(np.radians(15 * size.truck)) * (g.bead - inside_bead),
        offset=g.bead - inside_bead,  # carcass to the outer surface, which touches the flange
    )
    tip = line.rim - made.filler * (line.rim - line.widest)
    edges = sorted({edge for _, edge in layers.values()})
    s, labels = _stations([*edges, line.widest, tip, line.rim, line.end])
    buttress = half_belt + BUTTRESS * (line.widest - half_belt)
    total = PchipInterpolator(
        [0, half_belt / 2, half_belt, buttress, line.widest, line.rim, line.end],
        [g.crown, g.crown, SHOULDER * g.crown, g.sidewall, g.sidewall, g.bead, g.bead],
    )(s)
    inside = PchipInterpolator(
        [0, line.widest, line.rim, line.end], [g.liner, g.liner, inside_bead, inside_bead]
    )(s)
    rows = {"inner": -inside, "ply": np.zeros_like(s), "outer": total - inside}
    for name, (depth, edge) in layers.items():
        rows[name] = np.where(s <= edge + NANOMETRE, depth, np.nan)
    filled = (1 - STRIP) * (g.bead - inside_bead)
    turned = PchipInterpolator(
        [line.widest, tip, line.rim, line.end], [g.ply, g.ply, filled, filled]
    )
    there = s >= (line.widest if made.high else tip) - NANOMETRE
    rows[TURN_UP][there] = turned(s[there])
    gauged = np.stack([rows[name] for name in made.lines])
    table = GaugeTable(made.lines, "ply", line.at(s), gauged, labels, s >= line.rim - NANOMETRE)
    _check_width(size, table, line, s, width)
    return table


def _layers(g: Gauges, made: Construction) -> dict[str, tuple[float, float]]:
    """Distance from the carcass and half a width of every line under the tread, m."""
    belts = made.lines[2 : 2 + len(made.belts)]
    layers = {
        name: (g.ply + i * g.belts, (belt.share * g.belt - belt.steps * g.step) / 2)
        for i, (name, belt) in enumerate(zip(belts, made.belts, strict=True))
    }
    last = layers[belts[-1]][0]
    if made.cap:
        last += g.cap
        layers[CAP] = last, g.belt / 2
    return {**layers, BASE: (last + g.under_tread, g.belt / 2)}


def _stations(ends: list[float]) -> tuple[Array, list[str]]:
    """Arcs (n,), m, of the stations of regions that end at ``ends``, and each station's region."""
    belted = len(ends) - len(BELOW)
    names = ["crown", *["belt_edges"][: belted - 2], "shoulder"][:belted]
    counts = {**{name: BELTED[name] for name in names}, **BELOW}
    arc, labels = [0.0], ["crown"]
    for (name, count), a, b in zip(counts.items(), [0.0, *ends], ends, strict=False):
        arc += list(a + (b - a) * np.arange(1, count + 1) / count)
        labels += [name] * count
    labels[-BELOW["bead"] - 1] = "bead"  # the rim holds the station that the two share
    return np.array(arc), labels


def _check_width(size: TyreSize, table: GaugeTable, line: Meridian, s: Array, width: float) -> None:
    """Raises SectionError where the tyre is wider than its section ``width``, m. s: arcs (n,)
    of the stations."""
    outside = table.section().points[-1, :, 1]
    at = s[np.argmax(outside)]
    if outside.max() > width / 2 + 1e-5:
        what = "the belt is" if at < line.widest else "the rim is"
        raise SectionError(
            f"{size.text}: {what} too wide for a section {1e3 * width:.1f} mm wide, the tyre would"
            f" bulge beyond it at {1e3 * at:.0f} mm along the carcass"
        )


def _check(size: TyreSize, g: Gauges, depth: float) -> None:
    """Raises SectionError for gauges that no tyre has. depth: from the carcass to the tread, m."""
    width = size.section_width(g.rim)
    least = g.liner + depth + 1e-3
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
