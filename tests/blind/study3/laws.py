"""Faults of the tyres of study 3, written on the maker's own tyre.

Parameters mean what the catalogue's do and have its ranges; how they enter is the maker's own. Six
families that no catalogue holds, each with what it is in a workshop's words. They were chosen
before any diagnosis of theirs was run, and nothing was tuned on them. (A seventh was outside in the
series up to 6 and is in the catalogue now: a bead that does not sit, there over up to four fifths.)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.effects import catalogue

from .section import columns, mould
from .tyre import Tyre, tempered

Law = Callable[[Tyre, float], Tyre]


@dataclass(frozen=True)
class OwnLaw:
    """A parameter's range, and what it does."""

    low: float
    high: float
    add: Law

    def drawn(self, random: np.random.Generator, smallest: float) -> float:
        """Uniform over ``smallest`` to 1 of the range, on a side drawn by chance."""
        end = float(random.choice([end for end in (self.low, self.high) if end]))
        return end * float(random.uniform(smallest, 1.0))


def dynamic_stiffening(tyre: Tyre, e: float) -> Tyre:
    """Compounds by their share of filler: treads by a fifth more, the rest by a tenth less."""
    own = lambda name: 1.2 if name in ("tread", "under_tread") else 0.9
    compounds = {
        name: replace(m, dynamic=(m.C10 + m.dynamic) * (1 + own(name) * e) - m.C10)
        for name, m in tyre.compounds.items()
    }
    return replace(tyre, compounds=compounds) if e else tyre


def bead_filler(tyre: Tyre, e: float) -> Tyre:
    """A harder compound, which a higher filler goes with: a maker who stiffens does both."""
    taller = replace(tyre.mould, filler=tyre.mould.filler * (1 + 0.05 * e))
    return tempered(replace(tyre, mould=taller), "bead_filler", 1 + 0.9 * e)


def tread_density(tyre: Tyre, e: float) -> Tyre:
    """More or fewer voids: mass and stiffness of the pattern, not of what lies under the grooves,
    the whole tread's mass times 1 + e."""
    m = tyre.mould
    whole = m.base + m.skid * (1 - tyre.void)
    return replace(tyre, void=tyre.void - e * whole / m.skid)


def tread_wear(tyre: Tyre, e: float) -> Tyre:
    """Shoulders wear more than the middle."""
    return replace(tyre, mould=replace(tyre.mould, worn=e))


def belt_angle(tyre: Tyre, e: float) -> Tyre:
    """Cut at a wrong angle, as many cords a length of the cut: E A / s with 1 / cos of the turn;
    the inner belts by a tenth more than the outer ones."""
    cords = dict(tyre.cords)
    for name in (name for name in cords if name.startswith("belt")):
        own = cords[name]
        turn = np.radians(e) * (1.1 if int(name.split("_")[1]) % 2 else 0.9)
        angle = own.angle - turn if own.angle <= pi / 2 else own.angle + turn
        cords[name] = replace(own, angle=angle, stiffness=own.stiffness / float(np.cos(turn)))
    return replace(tyre, cords=cords)


def belt_width(tyre: Tyre, e: float) -> Tyre:
    """The wider belts by a fifth more, the narrow ones less; the mould is as it was."""
    m = tyre.mould
    widest = max(m.belts)
    belts = tuple(b + (0.6 if b == widest else 0.4) * e for b in m.belts)
    return replace(tyre, mould=replace(m, belts=belts, cap=m.cap + 0.5 * e))


def rim_width(tyre: Tyre, e: float) -> Tyre:
    """Beads apart by e, the section as the dimensions' rule has it: 0.4 e wider, and lower by what
    the carcass' length leaves."""
    m = tyre.mould
    (r, z), (rim_r, rim_z), (seat_r, seat_z) = m.widest, m.rim, m.seat
    return replace(
        tyre,
        mould=replace(
            m,
            widest=(r - 0.05 * e, z + 0.2 * e),
            rim=(rim_r, rim_z + e / 2),
            seat=(seat_r, seat_z + e / 2),
        ),
    )


def sidewall_gauge(tyre: Tyre, e: float) -> Tyre:
    """Rubber outside the carcass, most where the section is widest."""
    m = tyre.mould
    return replace(tyre, mould=replace(m, blown=1.25 * e * m.sidewall / (m.sidewall - m.liner)))


def pressure_offset(tyre: Tyre, e: float) -> Tyre:
    """A gauge whose scale is off: a share of the pressure, e kPa at the case's."""
    return replace(tyre, gauge=1e3 * e / tyre.nominal_Pa)


def temperature(tyre: Tyre, e: float) -> Tyre:
    """Exponential in static and vibrating rubber, each by its own rate, and in textile cords."""
    return replace(tyre, kelvin=tyre.kelvin + e)


def temperature_drift(tyre: Tyre, e: float) -> Tyre:
    """A run of pressures warms the tyre towards a temperature."""
    return replace(tyre, drift=e)


def cap_ply(tyre: Tyre, e: float) -> Tyre:
    """Wound over the cap's width, its edges by three tenths denser."""
    return replace(tyre, cap=e)


def carcass_fanning(tyre: Tyre, e: float) -> Tyre:
    """A/s by a power of the radius, from element to element, the turned-up ply's too."""
    return replace(tyre, fan=e)


def bead_seat(tyre: Tyre, e: float) -> Tyre:
    """The rim does not touch the outside of a share e of the bead, from the flange's top on."""
    return _held(tyre, e)


def _held(tyre: Tyre, unseated: float) -> Tyre:
    """With an element's end where the rim begins to hold."""
    plain = replace(mould(tyre.mould.size), unseated=unseated)
    return replace(
        tyre, mould=replace(tyre.mould, unseated=unseated), columns=tuple(columns(plain))
    )


def _spindle(way: str) -> Law:
    """A softer clamp of the wheel; its hub, a fifth of the wheel's mass that no case knows, moves
    with it."""

    def add(tyre: Tyre, e: float) -> Tyre:
        mass, polar, diametral = tyre.wheel
        return replace(
            tyre,
            spindle={**tyre.spindle, way: tyre.spindle.get(way, 0.0) + e},
            wheel=(1.2 * mass, 1.05 * polar, 1.1 * diametral) if not tyre.spindle else tyre.wheel,
        )

    add.__name__ = f"spindle_{way}"
    return add


CLAMP = tuple(f"spindle_{way}" for way in ("lateral", "radial", "torsional", "tilt"))


def parted_belts(tyre: Tyre, e: float) -> Tyre:
    """The belts have parted at their edges: over e m the rubber between holds next to nothing."""
    return replace(tyre, parted=e)


def shrunk_cords(tyre: Tyre, e: float) -> Tyre:
    """Not post-inflated: textile cords of carcass and cap shrank in cooling, steel did not."""
    cords = {name: replace(c, prestrain=-e) if c.textile else c for name, c in tyre.cords.items()}
    return replace(tyre, cords=cords)


def sealant(tyre: Tyre, e: float) -> Tyre:
    """A layer on the inside under the belt that seals punctures: mass, and no stiffness."""
    return replace(tyre, lining=e)


def high_flange(tyre: Tyre, e: float) -> Tyre:
    """A rim whose flange holds the sidewall e m further up, as a ring that clamps beads does."""
    m = tyre.mould
    return _held(tyre, -e / float(np.hypot(*np.subtract(m.rim, m.seat))))


def aged_skim(tyre: Tyre, e: float) -> Tyre:
    """Years of heat and air have hardened the rubber between the belts, which holds most sulphur:
    its modulus times 1 + e."""
    return tempered(tyre, "belt_skim", 1 + e)


def sticking_gauge(tyre: Tyre, e: float) -> Tyre:
    """Its pointer sticks low until the case's pressure is reached: right there and above; below, it
    reads too little, so that a share e more is in the tyre than wanted."""
    return replace(tyre, left_in=e)


def laws(case: LoadedCase) -> dict[str, OwnLaw]:
    """By the catalogue's ids, with its ranges on this tyre."""
    known = catalogue()
    return {
        add.__name__: OwnLaw(*known[add.__name__].range_on(case), add)
        for add in (
            dynamic_stiffening,
            bead_filler,
            tread_density,
            tread_wear,
            belt_angle,
            belt_width,
            rim_width,
            sidewall_gauge,
            pressure_offset,
            temperature,
            temperature_drift,
            cap_ply,
            carcass_fanning,
            bead_seat,
            *(_spindle(id.removeprefix("spindle_")) for id in CLAMP),
        )
    }


OUTSIDE: Mapping[str, OwnLaw] = {
    "parted_belts": OwnLaw(0.0, 0.03, parted_belts),
    "shrunk_cords": OwnLaw(0.0, 0.01, shrunk_cords),
    "sealant": OwnLaw(0.0, 6.0, sealant),
}
"""m of belt, strain, kg/m2: at most a third of half a belt, 1.8 kg of sealant in a 205/60R15."""
EVIDENT: Mapping[str, OwnLaw] = {
    "high_flange": OwnLaw(0.0, 0.010, high_flange),
    "aged_skim": OwnLaw(0.0, 3.0, aged_skim),
    "sticking_gauge": OwnLaw(0.0, 0.12, sticking_gauge),
}
"""Those that may move modes enough to be seen, drawn from `EVIDENT_FROM` of these ranges on until
they do: m of sidewall, and shares. In series 7 only the gauge did."""
EVIDENT_FROM = 0.6
