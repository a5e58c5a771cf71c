"""Half a tyre's section from a size code by arcs, as moulds are drawn: the makers' of study 3.

Nothing of `tyrecal.tyre.section` but what the code says of diameter, width and rim. The carcass is
two arcs, tangent to one another, to the crown and to the widest point's radius, as many a mould's
is; below, cubic curves with the handles of circular arcs, tangent at the rim. Real parts: a tread
with grooves of their own depth, under-tread, cap ply, belts of different widths, a bead filler that
tapers to a tip, a turned-up ply, wires in the bead. Lengths in m.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import asin, atan2, cos, sin, tan

import numpy as np
from scipy.interpolate import PchipInterpolator

from tyrecal.tyre.section.size import parse_size

Array = np.ndarray
VOID = 0.3  # of the pattern's volume
SKIM, TREAD = 1.15, 1.3  # how far belt skim and tread go, of the widest belt
COLUMN = {False: 0.0095, True: 0.0125}  # m, about an element's length; True: of a truck
CURVE_POINTS = 400


@dataclass(frozen=True)
class Mould:
    """Numbers of a half section. crown: outer radius; arc: the carcass' radius across the crown;
    belts: half widths along the carcass, from inside; cap: likewise; widest, rim, seat: (r, z) of
    the carcass, ``lean`` its angle from the radius at the rim; liner to skid: gauges, the last the
    grooves' depth; base: between under-tread and grooves; sidewall: all at the widest point;
    bead: all at the rim; filler, turn_up: heights above the rim's flange; wave, thicker: what is
    off, amplitudes of (1 - s) sines of the meridian, m, and shares at five places of the gauge
    outside and inside the carcass."""

    size: str
    crown: float
    arc: float
    belts: tuple[float, ...]
    cap: float
    widest: tuple[float, float]
    rim: tuple[float, float]
    seat: tuple[float, float]
    lean: float
    liner: float
    ply: float
    belt: float
    cover: float
    under_tread: float
    base: float
    skid: float
    sidewall: float
    bead: float
    filler: float
    turn_up: float
    wave: tuple[float, ...] = (0.0, 0.0, 0.0)
    thicker: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    thinner_inside: tuple[float, ...] = (0.0, 0.0)
    worn: float = 0.0  # of skid and base, more towards the shoulder
    blown: float = 0.0  # share more outside the carcass about the widest point
    unseated: float = 0.0  # share of the bead, from its top, that the rim lets go; < 0: holds more

    @property
    def crown_gauge(self) -> float:
        """From the inner surface to the top of the pattern."""
        plies = self.liner + self.ply + (len(self.belts) - 1) * self.belt + self.cover
        return plies + self.under_tread + self.base + self.skid

    @property
    def lines(self) -> tuple[str, ...]:
        """From inside; ``turn_up`` is the first belt's, which goes on as the turned-up ply's."""
        belts = [f"belt_{i + 1}" for i in range(len(self.belts))]
        return ("inner", "ply", *belts, "cap", "base", "groove", "outer")


def mould(text: str) -> Mould:
    """Mould of a size code, by usual proportions of cut tyres. Belts are narrower than the tread,
    which is about 0.8 S wide on a truck. Beads grow with the section, not with the rim. A truck's
    turned-up ply ends below its filler's tip, because cords that end above it would part there; its
    carcass leans 25 to 35 degrees at a quarter of the height and less at the rim."""
    size = parse_size(text)
    S, H = size.section_width(size.measuring_rim), size.section_height
    truck = size.truck
    flange, widest = size.flange_radius(size.measuring_rim), size.rim_code * 0.0127 + 0.505 * H
    bead = (0.105 if truck else 0.057) * S
    sidewall = 0.03 * S + (0.003 if truck else -0.0012)
    belted = 0.72 if truck else min(0.84, max(0.76, 0.74 + 0.55 * (0.65 - H / size.width)))
    half = 0.5 * S * belted
    widths = (0.72, 1.0, 0.88, 0.72) if truck else (1.0, 0.9)
    gauges = (
        (0.0032, 0.0024, 0.0024, 0.0014, 0.0025, 0.0025, 0.0135)
        if truck
        else (0.0013, 0.0013, 0.00125, 0.001, 0.0014, 0.0016, 0.008)
    )
    liner, ply, belt, cover, under, base, skid = gauges
    rim = size.measuring_rim / 2 - 0.7 * bead
    deep = flange - size.bead_seat_radius - (0.004 if truck else 0.003)
    lean = 0.4 if truck else 0.5
    return Mould(
        text,
        size.overall_diameter / 2,
        arc=2.4 * S if truck else min(1.615 * S / H, 3.2) * S,
        belts=tuple(half * w for w in widths),
        cap=half * (0.55 if truck else 0.97),
        widest=(widest, S / 2 - sidewall + liner),
        rim=(flange, rim),
        seat=(flange - deep, rim - tan(lean) * deep),
        lean=lean,
        liner=liner,
        ply=ply,
        belt=belt,
        cover=cover,
        under_tread=under,
        base=base,
        skid=skid,
        sidewall=sidewall,
        bead=bead,
        filler=0.35 * H if truck else 0.5 * (widest - flange),
        turn_up=0.2 * H if truck else 0.52 * H,
    )


def off(known: Mould, random: np.random.Generator, meridian: float, gauge: float) -> Mould:
    """A tyre of this mould as it came out: standard deviations in m and as a share."""
    waves = random.normal(size=3) / np.arange(1, 4)
    rms = float(np.sqrt((waves**2).sum() / 2)) or 1.0
    return replace(
        known,
        wave=tuple((waves / rms * meridian * abs(random.normal())).tolist()),
        thicker=tuple((gauge * random.normal(size=4)).tolist()),
        thinner_inside=tuple((gauge * random.normal(size=2)).tolist()),
        filler=known.filler * (1 + gauge * random.normal()),
        turn_up=known.turn_up * (1 + gauge * random.normal()),
    )


def arc_like(p: Array, q: Array, a: float, b: float) -> Array:
    """Points of a cubic curve from p to q, its tangent turning from angle a to b, (cos, sin) being
    (z, r): handles as a circular arc between them has."""
    reach = np.linalg.norm(q - p) / (3 * cos((b - a) / 4) ** 2)
    along = [np.array([sin(x), cos(x)]) for x in (a, b)]
    t = np.linspace(0, 1, CURVE_POINTS)[:, None]
    one, two = p + reach * along[0], q - reach * along[1]
    s = 1 - t
    return np.asarray(s**3 * p + 3 * s * s * t * one + 3 * s * t * t * two + t**3 * q)


@dataclass(frozen=True)
class Section:
    """Lines by columns: points (lines, columns, 2), r and z; offsets (lines, columns) from the
    carcass; s (columns,) of the carcass; marks by name: s of the belts' edges, the filler's tip,
    the turn-up's end, the rim, where it holds, the end."""

    mould: Mould
    points: Array
    offsets: Array
    s: Array
    marks: dict[str, float]


def carcass(m: Mould) -> tuple[Array, Array, dict[str, float]]:
    """s (k,), points (k, 2) of the carcass, and the marks on it."""
    r0, R, half = m.crown - m.crown_gauge + m.liner, m.arc, max(m.belts)
    widest, rim, seat = (np.array(p) for p in (m.widest, m.rim, m.seat))
    # both arcs' centres lie (R - q) apart: (w_r - r0 + R)^2 + (w_z - q)^2 = (R - q)^2
    low, wide = widest[0] - r0 + R, widest[1]
    q = (R * R - low * low - wide * wide) / (2 * (R - wide))
    meet, down = asin((wide - q) / (R - q)), -np.pi / 2
    x, y = np.linspace(0, meet, CURVE_POINTS), np.linspace(meet, np.pi / 2, CURVE_POINTS)
    crown = np.stack([r0 - R * (1 - np.cos(x)), R * np.sin(x)], 1)
    upper = np.stack([widest[0] + q * np.cos(y), wide - q + q * np.sin(y)], 1)
    lower = arc_like(widest, rim, down, down - m.lean)
    chord = seat - rim
    end = arc_like(rim, seat, down - m.lean, atan2(chord[0], chord[1]))
    line = np.concatenate([crown, upper[1:], lower[1:], end[1:]])
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    place = lambda k: float(s[k * (CURVE_POINTS - 1)])
    marks = {"belt": half, "widest": place(2), "rim": place(3), "end": place(4)}
    marks["held"] = marks["rim"] + m.unseated * (marks["end"] - marks["rim"])
    below = (marks["belt"] < s) & (s <= marks["rim"])
    at = lambda height: float(np.interp(-(m.rim[0] + height), -line[below, 0], s[below]))
    marks |= {"filler": at(m.filler), "turn_up": at(m.turn_up)}
    # what is off fades to nothing at the rim, and leaves the plane of the crown as it is
    normal = np.gradient(line, axis=0) @ np.array([[0.0, -1.0], [1.0, 0.0]])
    normal /= np.hypot(*normal.T)[:, None]
    share = 1 - np.clip(s / marks["rim"], 0, 1)
    waves = sum(a * np.sin(k * np.pi / 2 * share) for k, a in zip((1, 3, 5), m.wave, strict=True))
    return s, line + np.asarray(waves)[:, None] * normal, marks


def breaks(m: Mould, marks: dict[str, float]) -> list[float]:
    """s where parts begin or end, from the crown on, and where the rim begins to hold."""
    half, tip, rim, held = max(m.belts), marks["filler"], marks["rim"], marks["held"]
    edges = [*m.belts, m.cap, SKIM * half, TREAD * half]
    ends = sorted([*edges, marks["turn_up"], tip, (tip + rim) / 2, rim, held, marks["end"]])
    return [0.0, *(b for a, b in zip([0.0, *ends], ends, strict=False) if b - a > 1e-4)]


def columns(m: Mould, times: int = 1) -> list[int]:
    """Elements between breaks; ``times`` as many along the section."""
    ends, element = np.diff(breaks(m, carcass(m)[2])), COLUMN[parse_size(m.size).truck] / times
    return [max(1, round(float(d) / element)) for d in ends]


def section(m: Mould, counts: Sequence[int], each: int = 2) -> Section:
    """With ``each`` columns an element of ``counts`` (intervals between breaks). Raises ValueError
    where parts do not lie in their usual order."""
    ends = breaks(m, carcass(m)[2])
    if len(ends) != len(counts) + 1:
        raise ValueError("the section's parts do not lie in their usual order")
    spans = zip(ends, ends[1:], counts, strict=False)
    parts = [a + (b - a) * np.arange(each * n) / (each * n) for a, b, n in spans]
    return at(m, np.concatenate([*parts, [ends[-1]]]))


def at(m: Mould, s: Array) -> Section:
    """Its lines at places s of the carcass."""
    arc, line, marks = carcass(m)
    place = np.stack([np.interp(s, arc, line[:, k]) for k in range(2)], 1)
    tangent = np.gradient(line, arc, axis=0)
    normal = np.stack([np.interp(s, arc, tangent[:, 1]), -np.interp(s, arc, tangent[:, 0])], 1)
    normal /= np.hypot(*normal.T)[:, None]
    normal[0] = (1.0, 0.0)
    offsets = _offsets(m, s, marks)
    return Section(m, place + offsets[..., None] * normal, offsets, s, marks)


def _offsets(m: Mould, s: Array, marks: dict[str, float]) -> Array:
    """Offset of each line from the carcass, m outwards: (lines, columns)."""
    half, widest, rim = marks["belt"], marks["widest"], marks["rim"]
    five = np.linspace(0, rim, 5)
    inside = PchipInterpolator(
        [0, widest, rim, marks["end"] + 1e-9], [m.liner, m.liner, 0.25 * m.bead, 0.25 * m.bead]
    )(s)
    inside *= 1 + np.interp(s, [0, widest, rim], [*m.thinner_inside, 0.0])
    wear = m.worn * (0.85 + 0.45 * np.clip(s / half, 0, 1) ** 2)
    tread = (m.base + m.skid) * (1 - np.clip(wear, 0, 0.97))
    plies = np.cumsum([m.ply, *[m.belt] * (len(m.belts) - 1), m.cover, m.under_tread])
    base = plies[-1] * (1 + 0.0 * s)
    shoulder = plies[-1] + 0.9 * tread
    # outside: the crown's gauge to the belt's edge, then down to the sidewall's, up to the bead's
    full = plies[-1] + tread * (1 - 0.1 * np.clip(s / half, 0, 1) ** 3)
    fade = np.clip((s - half) / (0.6 * (widest - half)), 0, 1)
    fade = fade * fade * (3 - 2 * fade)
    foot = PchipInterpolator(
        [0, widest, rim, marks["end"] + 1e-9],
        [m.sidewall - m.liner, m.sidewall - m.liner, 0.75 * m.bead, 0.75 * m.bead],
    )(s)
    foot *= 1 + m.blown * np.exp(-(((s - widest) / (0.35 * (rim - half))) ** 2))
    outside = (1 - fade) * np.minimum(full, np.where(s > half, shoulder, np.inf)) + fade * foot
    outside *= 1 + np.interp(s, five, [*m.thicker, 0.0])
    # the turned-up ply: skim above the filler's tip, the filler's taper below it
    taper = np.clip((s - marks["filler"]) / (rim - marks["filler"]), 0, 1)
    turned = m.ply + taper * (0.55 * 0.75 * m.bead - m.ply)
    blend = np.clip((s - half) / (0.3 * half), 0, 1)
    blend = blend * blend * (3 - 2 * blend)
    count = len(plies) + 1  # of lines between ply and outside, the groove's too
    lines = []
    for k in range(count):
        over = (
            plies[k] + 0 * s
            if k < count - 1
            else base + np.maximum(tread * m.base / (m.base + m.skid), 2e-4)
        )
        share = np.array([0.0, *np.linspace(0, 1, count + 1)[1:-1]])[k]
        side = turned + share * (outside - turned)
        lines.append(
            (1 - blend) * np.minimum(over, 0.96 * outside * (k + 1 + 9 * count) / (10 * count))
            + blend * side
        )
    return np.stack([-inside, 0 * s, *lines, outside])
