"""Implausible numbers of a case, reported before they are computed with: most are slips of unit.

Usual values of what a user states reach from passenger cars' tyres to trucks'; a number outside its
range stands most often in another unit. The ranges are wide: they hold what is built and tested,
not what is good. Only what a user states is judged, never a point that a search tries: the file's
own numbers, and those set beside it. Bounds of variables only say how far a search may go, so they
are free.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import pi, sqrt
from typing import TYPE_CHECKING, Any

from ..units import INCH, LENGTH, LOAD, PRESSURE, QUANTITIES, printed_unit
from .case.checks import Problems, at, find
from .case.mistakes import CaseData, Keys
from .case.parts import number
from .case.shape import entries, table
from .effects import catalogue
from .footprint_quantities import FOOTPRINT_QUANTITIES
from .plugins import IDS

if TYPE_CHECKING:
    from .section.section import Section

READING_RTOL = 0.05  # readings that differ by less are one: bar and atm
Slips = Mapping[str, float | Callable[[float], float]]
"""Units that may have been meant, each with the factor, or the function, to the right unit."""
ALL_THE_SAME = " (--allow-unusual accepts it)"
_SIGMAS = {"frequency_Hz": "sigma_Hz", "mass_kg": "sigma_kg"} | {
    name: each.sigma for name, each in FOOTPRINT_QUANTITIES.items()
}


@dataclass(frozen=True)
class Usual:
    """A number from ``low`` to ``high``, in ``unit``; those smaller than ``least`` are 0. reason:
    where the bounds come from."""

    low: float
    high: float
    unit: str = ""
    slips: Slips = field(default_factory=dict)
    least: float = 0.0
    reason: str = ""

    def holds(self, value: float) -> bool:
        """Whether ``value`` is usual."""
        return self.low <= value <= self.high and (value == 0 or abs(value) >= self.least)

    @property
    def span(self) -> str:
        """The range in words, without its unit."""
        low = f"0, or {self.least:g}" if self.least and self.low == 0 else f"{self.low:g}"
        return f"{low} to {self.high:g}"

    def refusal(self, value: float) -> str | None:
        """Sentence with the range that is usual instead of ``value``, and what was probably meant;
        None where the value is usual."""
        if self.holds(value):
            return None
        unit = f" {printed_unit(self.unit)}" if self.unit else ""
        least = f", of a size of at least {self.least:g} or 0" if self.low < 0 < self.least else ""
        meant = self._meant(value, unit)
        question = f"; did you mean {' or '.join(meant)}?" if meant else ""
        return f"usual is {self.span}{unit}{least}{self.reason}{question}"

    def _meant(self, value: float, unit: str) -> list[str]:
        """At most two readings of ``value`` that would be usual, in words; of those that are almost
        the same, the first."""
        readings: dict[float, str] = {}
        for name, slip in self.slips.items():
            right = slip(value) if callable(slip) else slip * value
            alike = any(abs(right - other) <= READING_RTOL * abs(other) for other in readings)
            if value and self.holds(right) and not alike:
                readings[right] = f"{value:g} {printed_unit(name)}, {right:.4g}{unit}"
        return list(readings.values())[:2]


def inverse(of: float) -> Callable[[float], float]:
    """``of`` / value: what is counted instead of spaced, stiff instead of compliant."""
    return lambda value: of / value if value else 0.0


AREA, FREQUENCY = QUANTITIES["contact_area_m2"], {**QUANTITIES["frequency_Hz"], "mHz": 1e-3}
STIFFNESS = QUANTITIES["vertical_stiffness_N_per_m"]
STRESS = {"MPa": 1e6, "GPa": 1e9, "kPa": 1e3, "bar": 1e5, "psi": 6894.757}
DENSITY = {"g/cm3": 1e3, "t/mm3": 1e12, "kg/mm3": 1e9, "lb/in3": 27679.9, "lb/ft3": 16.0185}
MASS_UNITS = {"g": 1e-3, "t": 1e3}
INERTIA = {"kg mm2": 1e-6, "kg cm2": 1e-4, "t mm2": 1e-3}
COMPLIANCE: Slips = {
    "N/m of stiffness": inverse(1.0),
    "N/mm of stiffness": inverse(1e-3),
    "mm/N": 1e-3,
    "m/kN": 1e-3,
    "mm/kN": 1e-6,
}
TURNING: Slips = {
    "N m/rad of stiffness": inverse(1.0),
    "rad/(kN m)": 1e-3,
    "rad/(N mm)": 1e3,
    "degrees/(N m)": pi / 180,
}
ANGLE = {"rad": 180 / pi}
FROM_CIRCUMFERENCE: Slips = {**ANGLE, "degrees from the circumference": lambda a: 90 - a}
SHARE = {"%": 0.01}
SPIN_UNITS = {"rpm": pi / 30, "degrees/s": pi / 180}
CELSIUS: Slips = {"K": lambda T: T - 273.15, "degrees Fahrenheit": lambda T: (T - 32) / 1.8}
# of measured values, in the units of the measurements CSV
USUAL_MEASUREMENTS = {
    "frequency_Hz": Usual(2, 1000, "Hz", FREQUENCY),
    "contact_area_m2": Usual(1e-4, 0.5, "m2", AREA),
    "contact_length_m": Usual(0.005, 1.0, "m", LENGTH),
    "contact_width_m": Usual(0.005, 0.8, "m", LENGTH),
    "vertical_stiffness_N_per_m": Usual(1e4, 1e7, "N/m", STIFFNESS),
    "mass_kg": Usual(0.5, 500, "kg", QUANTITIES["mass_kg"]),
    "damping_ratio": Usual(1e-4, 0.5, "", SHARE, reason=" of critical damping"),
}
MAX_SIGMA = 0.2  # of the value: such a number tells nothing
MIN_SIGMA = 1e-5  # of the value: nothing is measured so well
# of the numbers of a case, by path; * is any name or place in a list
USUAL: dict[str, Usual] = {
    "pressure_kPa": Usual(50, 1200, "kPa", PRESSURE),
    "section.outline.belt_width_m": Usual(0.05, 0.5, "m", LENGTH),
    "section.outline.rim_radius_m": Usual(0.1, 0.35, "m", LENGTH),
    "section.outline.carcass_depth_m": Usual(1e-4, 0.02, "m", LENGTH),
    "section.outline.belt_depth_m": Usual(1e-4, 0.02, "m", LENGTH),
    "section.outline.belt_spacing_m": Usual(1e-4, 0.02, "m", LENGTH),
    "section.outline.belt_step_m": Usual(1e-4, 0.05, "m", LENGTH),
    "mesh.hourglass_stiffness_Pa": Usual(1e2, 1e9, "Pa", STRESS),
    # rubber: the shear modulus 2 (C10 + C01) is judged by `constant_beside`; bulk modulus 2 / D1
    "materials.*.C10_Pa": Usual(-1e7, 2e7, "Pa", STRESS, least=1e3),
    "materials.*.C01_Pa": Usual(-1e7, 2e7, "Pa", STRESS, least=1e2),
    "materials.*.D1_per_Pa": Usual(
        1e-10,
        2e-6,
        "1/Pa",
        {
            "1/MPa": 1e-6,
            "1/GPa": 1e-9,
            "Pa of bulk modulus K, D1 = 2/K": inverse(2.0),
            "MPa of bulk modulus K, D1 = 2/K": inverse(2e-6),
        },
    ),
    "materials.*.prony.*.g": Usual(0, 0.95, "", SHARE),
    "materials.*.prony.*.k": Usual(0, 0.95, "", SHARE),
    "materials.*.prony.*.tau_s": Usual(1e-7, 1e5, "s", {"ms": 1e-3}),
    "materials.*.loss_factor": Usual(0, 1, "", SHARE, reason=" of rubber"),
    "materials.*.loss_factor.*.0": Usual(0.01, 1e5, "Hz", FREQUENCY),
    "materials.*.loss_factor.*.1": Usual(0, 1, "", SHARE, reason=" of rubber"),
    "materials.*.reference_frequency_Hz": Usual(0.1, 1000, "Hz", FREQUENCY),
    # textile cords 1 to 25 GPa, aramid 60 to 130, steel 150 to 210: see `cord_modulus`
    "materials.*.youngs_modulus_Pa": Usual(5e8, 3e11, "Pa", STRESS),
    "materials.*.poissons_ratio": Usual(0, 0.5, "", least=0.05),
    "materials.*.density_kg_per_m3": Usual(500, 9000, "kg/m3", DENSITY),
    "rebar_layers.*.area_m2": Usual(
        5e-9, 2e-5, "m2", {**AREA, "m of diameter": lambda d: pi * d**2 / 4}
    ),
    "rebar_layers.*.spacing_m": Usual(
        2e-4,
        0.02,
        "m",
        {"mm": 1e-3, "cords per decimetre": inverse(0.1), "cords per inch": inverse(INCH)},
    ),
    "rebar_layers.*.spacing_deg": Usual(0.01, 5, "degrees", ANGLE),
    "rim.reference_point_m.r": Usual(-1, 1, "m", LENGTH),
    "rim.reference_point_m.z": Usual(-1, 1, "m", LENGTH),
    "rim.mass_kg": Usual(1, 200, "kg", MASS_UNITS),
    "rim.polar_inertia_kg_m2": Usual(0.01, 30, "kg m2", INERTIA),
    "rim.diametral_inertia_kg_m2": Usual(0.01, 30, "kg m2", INERTIA),
    "rim.spindle.lateral_m_per_N": Usual(0, 1e-5, "m/N", COMPLIANCE, least=1e-10),
    "rim.spindle.radial_m_per_N": Usual(0, 1e-5, "m/N", COMPLIANCE, least=1e-10),
    "rim.spindle.torsional_rad_per_N_m": Usual(0, 1e-3, "rad/(N m)", TURNING, least=1e-9),
    "rim.spindle.tilt_rad_per_N_m": Usual(0, 1e-3, "rad/(N m)", TURNING, least=1e-9),
    "cavity.temperature_C": Usual(-50, 150, "degrees Celsius", CELSIUS),
    "cavity.share": Usual(0, 2, "", SHARE),
    "spin_rad_per_s": Usual(0, 300, "rad/s", SPIN_UNITS),
    "point_mass.mass_kg": Usual(0, 2, "kg", MASS_UNITS),
    "point_mass.z_m": Usual(-0.3, 0.3, "m", LENGTH),
    "road_spring.radial_N_per_m": Usual(0, 5e6, "N/m", STIFFNESS, least=100),
    "road_spring.lateral_N_per_m": Usual(0, 5e6, "N/m", STIFFNESS, least=100),
    "road_spring.tangential_N_per_m": Usual(0, 5e6, "N/m", STIFFNESS, least=100),
    "road_spring.width_m": Usual(0.005, 0.4, "m", LENGTH),
    "splice.share": Usual(-0.9, 2, "", SHARE),
    "analysis.vibration_frequency_Hz": Usual(0.1, 1000, "Hz", FREQUENCY),
    "road.friction": Usual(0, 2, "", SHARE),
    "road.stiffness_Pa_per_m": Usual(1e8, 1e13, "Pa/m", {"MPa/mm, or N/mm3": 1e9}),
    "road.elastic_slip_m": Usual(1e-6, 1e-2, "m", LENGTH),
    "road.loads_N.*": Usual(100, 6e4, "N", LOAD),
    "targets.modes.*.frequency_Hz": USUAL_MEASUREMENTS["frequency_Hz"],
    "targets.modes.*.damping_ratio": USUAL_MEASUREMENTS["damping_ratio"],
    "targets.modes.*.weight": Usual(0, 1e4, "", least=1e-4),
    "targets.modes.*.pressure_kPa": Usual(50, 1200, "kPa", PRESSURE),
    "targets.modes.*.load_N": Usual(100, 6e4, "N", LOAD),
    "targets.mass.mass_kg": USUAL_MEASUREMENTS["mass_kg"],
    "targets.mass.weight": Usual(0, 1e4, "", least=1e-4),
    "targets.footprint.*.pressure_kPa": Usual(50, 1200, "kPa", PRESSURE),
    "targets.footprint.*.load_N": Usual(100, 6e4, "N", LOAD),
    **{f"targets.footprint.*.{name}": USUAL_MEASUREMENTS[name] for name in FOOTPRINT_QUANTITIES},
    "targets.footprint.*.weight": Usual(0, 1e4, "", least=1e-4),
    "uncertainties.*.percent": Usual(0.001, 100, "%"),
    "solver.time_limit_s": Usual(1, 1e6, "s"),
}
# cords' angles, from the meridian, in a half turn: of a radial tyre
CARCASS_ANGLE = Usual(-30, 30, "degrees from the meridian", FROM_CIRCUMFERENCE)
BELT_ANGLE = Usual(25, 155, "degrees from the meridian", FROM_CIRCUMFERENCE)
SHEAR_MODULUS_Pa = 3e5, 4e7  # of rubber
MEAN_SHEAR_MODULUS_Pa = 6e5, 9.5e6  # of all rubber of a tyre; apexes are stiffer, and few
RUBBER_DENSITY = Usual(700, 2500, "kg/m3", DENSITY, reason=" of rubber")
MIN_RELAXED = 0.005  # of a modulus by the largest Prony term; rubber relaxes more
SLOWEST_TERM_s = 1e-3  # a series of faster terms alone acts above a tyre's modes, beyond 160 Hz
STEEL_DENSITY = 5000.0  # kg/m3 from which a cord is steel, filled with rubber or not
TEXTILE_DENSITY = 800.0, 2000.0  # kg/m3; aramid has the largest modulus of those
TEXTILE_MODULUS_Pa = 1.5e11
# N/m, modulus times area over spacing, that a layer of cords has; of a cap ply it may be less
MIN_STIFFNESS, MAX_STIFFNESS, MAX_STIFFNESS_OF_STEEL = 5e5, 3e7, 3e8
# diameter of cords over their spacing, by the area: of a belt, and of a layer that may be two plies
THINNEST_CORD, THICKEST_CORD, THICKEST_OF_TWO_PLIES = 0.2, 1.2, 1.7
MIN_ANGLE_OF_A_SIDE = 5.0  # degrees from the circumference, of a belt that has a side
# slips of effects' parameters, whose ranges the catalogue has, by their unit
OF_EFFECTS: dict[str, Slips] = {
    "": SHARE,
    "m": LENGTH,
    "kg": MASS_UNITS,
    "N/m": STIFFNESS,
    "kPa": PRESSURE,
    "rad/s": SPIN_UNITS,
    "m/N": COMPLIANCE,
    "rad/(N m)": TURNING,
    "degrees": ANGLE,
    "1/kg": {"kg": inverse(1.0)},
}
# of 'tyrecal init', in the units of its options
GAUGES = {
    "crown_mm": Usual(3, 50, "mm", {"m": 1e3, "cm": 10, "inch": 25.4}),
    "sidewall_mm": Usual(1, 40, "mm", {"m": 1e3, "cm": 10, "inch": 25.4}),
    "bead_mm": Usual(2, 60, "mm", {"m": 1e3, "cm": 10, "inch": 25.4}),
    "belt_width_mm": Usual(50, 500, "mm", {"m": 1e3, "cm": 10, "inch": 25.4}),
    "rim_width_in": Usual(2, 20, "inches", {"mm": 1 / 25.4, "cm": 1 / 2.54}),
}
_PATTERNS = [(tuple(path.split(".")), usual) for path, usual in USUAL.items()]


def unusual(data: CaseData, section: Section | None) -> Problems:
    """Every stated number of ``data`` that is outside its usual range, and what is usual."""
    refused: set[Keys] = set()
    for keys, value in _numbers(data, ()):
        of_a_sum = keys[-1] == "C01_Pa" and USUAL["materials.*.C01_Pa"].holds(value)
        if of_a_sum and (*keys[:-1], "C10_Pa") in refused:
            continue
        if message := refusal(data, section, keys, value):
            refused.add(keys)
            yield keys, message
    yield from belts_on_one_side(data, section)


def holds_angle(usual: Usual, value: float) -> bool:
    """Whether a value is usual; of an angle of cords, in any of its half turns."""
    if usual is BELT_ANGLE:
        value %= 180
    if usual is CARCASS_ANGLE:
        value = (value + 90) % 180 - 90
    return usual.holds(value)


def constant_beside(usual: Usual, factor: float, others_Pa: float, share: float = 0.0) -> Usual:
    """Narrow the range of a rubber's constant: ``factor`` times it and ``others_Pa`` are the shear
    modulus. share: of the section's rubber, 0 if it is not known."""
    least, most = SHEAR_MODULUS_Pa
    if share:
        least = max(least, MEAN_SHEAR_MODULUS_Pa[0] * share)
        most = min(most, MEAN_SHEAR_MODULUS_Pa[1] / share)
    low, high = (least - others_Pa) / factor, (most - others_Pa) / factor
    low, high = max(low, usual.low), min(high, usual.high)
    if low >= high:  # another constant is wrong
        return usual
    reason = f", for a shear modulus of {least / 1e6:.2g} to {most / 1e6:.2g} MPa"
    return replace(usual, low=low, high=high, reason=reason)


def in_series(usual: Usual, key: str, value: float, others: Sequence[float]) -> Usual:
    """Narrow the range of the largest number of a Prony series beside the same number, g, k or
    tau, of its other terms; of a smaller one it stays."""
    if any(other > value for other in others):
        return usual
    if key in ("g", "k"):
        return replace(usual, least=MIN_RELAXED, reason=" of the largest term")
    return replace(usual, low=SLOWEST_TERM_s, reason=" of the slowest term")


@dataclass(frozen=True)
class CordLayer:
    """Cords of one layer: area m2, spacing m across them, angle in degrees from the meridian, and
    its usual angle, which tells a belt."""

    area: float
    spacing: float
    angle: float
    usual_angle: Usual | None

    @property
    def is_belt(self) -> bool:
        """Whether it is over the crown alone."""
        return self.usual_angle is BELT_ANGLE

    @property
    def bears_load(self) -> bool:
        """Whether it is a carcass, or a belt that is no cap ply."""
        is_cap = self.is_belt and abs(self.angle % 180 - 90) < MIN_ANGLE_OF_A_SIDE
        return not is_cap

    @property
    def usual_area(self) -> Usual:
        """Range of the area, m2: cords fill a layer, gum and wrapping apart."""
        usual = USUAL["rebar_layers.*.area_m2"]
        if self.usual_angle is None or not USUAL["rebar_layers.*.spacing_m"].holds(self.spacing):
            return usual
        most = THICKEST_CORD if self.is_belt else THICKEST_OF_TWO_PLIES
        low, high = (pi / 4 * (ratio * self.spacing) ** 2 for ratio in (THINNEST_CORD, most))
        reason = f", for {'belt ' * self.is_belt}cords every {1e3 * self.spacing:.4g} mm"
        return replace(usual, low=max(usual.low, low), high=min(usual.high, high), reason=reason)


def cord_modulus(density: float | None, layers: Iterable[CordLayer]) -> Usual:
    """Range of a cord's modulus, Pa, by its density, kg/m3, and the stiffness of its layers."""
    usual = USUAL["materials.*.youngs_modulus_Pa"]
    most = USUAL["materials.*.density_kg_per_m3"].high
    stiffest = MAX_STIFFNESS_OF_STEEL
    if density is not None and STEEL_DENSITY <= density <= most:
        usual = replace(usual, low=5e10, high=2.5e11, reason=" of steel, by its density")
    elif density is not None and TEXTILE_DENSITY[0] <= density <= TEXTILE_DENSITY[1]:
        stiffest = MAX_STIFFNESS
        usual = replace(usual, high=TEXTILE_MODULUS_Pa, reason=" of textile, by its density")
    lows, highs = [usual.low], [usual.high]
    for layer in layers:
        if layer.usual_angle and layer.usual_area.holds(layer.area):
            lows.append(MIN_STIFFNESS * layer.spacing / layer.area if layer.bears_load else 0.0)
            highs.append(stiffest * layer.spacing / layer.area)
    low, high = (float(f"{each:.2g}") for each in (max(lows), min(highs)))
    if (low, high) != (usual.low, usual.high) and low < high:
        bounds = f"{MIN_STIFFNESS / 1e3:g} to {stiffest / 1e3:g} N/mm"
        reason = f", for layers of {bounds} (modulus times area over spacing)"
        usual = replace(usual, low=low, high=high, reason=reason)
    return usual


def one_side(angles: Iterable[float]) -> str | None:
    """Why belts at ``angles`` degrees from the meridian are not a tyre's: all lie on one side of
    the circumference. None where they are, or where there are fewer than two."""
    belts = [angle % 180 for angle in angles if abs(angle % 180 - 90) >= MIN_ANGLE_OF_A_SIDE]
    if len(belts) < 2 or len({angle > 90 for angle in belts}) > 1:
        return None
    return (
        f"usual are belts on both sides of the circumference, all {len(belts)} are on one; did you"
        f" mean {180 - belts[-1]:g} degrees?"
    )


def belts_on_one_side(data: CaseData, section: Section | None) -> Problems:
    """The last belt of the case where all lie on one side of the circumference."""
    belts = {}
    layers = table(data, "rebar_layers")
    for name in layers if section else ():
        layer = {**table(layers, name), **_start(data, f"rebar_layers.{name}.angle_deg")}
        angle = number(layer, "angle_deg")
        if section and angle is not None and _angle(layer, section) is BELT_ANGLE:
            belts[name] = angle
    if message := one_side(belts.values()):
        yield ("rebar_layers", [*belts][-1], "angle_deg"), message + ALL_THE_SAME


def _start(data: CaseData, path: str) -> dict[str, Any]:
    """The start of the variable that sets the number at ``path``, by the number's key; empty
    without one."""
    key = path.rpartition(".")[2]
    variables = [table(table(data, "variables"), name) for name in table(data, "variables")]
    return next(
        ({key: v["start"]} for v in variables if path in entries(v, "sets") and "start" in v), {}
    )


def refusal(data: CaseData, section: Section | None, keys: Keys, value: float) -> str | None:
    """Why ``value`` is not usual at ``keys`` of the case that ``data`` and ``section`` are of."""
    for usual, of in () if isinstance(value, bool) else _ranges(data, section, keys, value):
        if keys[-1] == "C01_Pa" and value == 0:  # C10 is judged
            continue
        if not holds_angle(usual, value) and (message := usual.refusal(value)):
            return of + message + ALL_THE_SAME
    return None


def _ranges(
    data: CaseData, section: Section | None, keys: Keys, value: float
) -> Iterator[tuple[Usual, str]]:
    """Usual ranges of ``value`` at ``keys``, each with words that go before."""
    here, last = keys[0], str(keys[-1])
    if here == "variables":
        for path in entries(at(data, keys[:-1]), "sets") if last == "start" else ():
            if isinstance(path, str) and (path_keys := _keys(data, path)):
                ranges = _ranges(data, section, path_keys, value)
                yield from ((usual, f"{path}: ") for usual, _ in ranges)
    elif here == "uncertainties" and last == "absolute":
        for path in entries(at(data, keys[:-1]), "sets"):
            if isinstance(path, str) and (path_keys := _keys(data, path)):
                own = number({"": _value(data, path_keys)}, "")
                for usual, _ in _ranges(data, section, path_keys, own or 0.0):
                    most = abs(own) if own and usual.holds(own) else usual.high
                    yield Usual(0, most, usual.unit, usual.slips), f"{path}: "
    elif here == "effects" and len(keys) == 2 and last in IDS:
        effect = catalogue()[last]
        slips = OF_EFFECTS.get(effect.unit, {})
        yield Usual(effect.low, effect.high, effect.unit, slips), ""
    elif here == "rebar_layers" and last == "angle_deg":
        if section and (angle := _angle(table(table(data, here), str(keys[1])), section)):
            yield angle, ""
    elif here == "targets" and last in _SIGMAS.values():
        for quantity in (name for name, sigma in _SIGMAS.items() if sigma == last):
            mean = number(at(data, keys[:-1]), quantity)
            if mean and mean > 0:
                whole = USUAL_MEASUREMENTS[quantity]
                yield replace(whole, low=MIN_SIGMA * mean, high=MAX_SIGMA * mean), ""
    else:
        words = tuple(map(str, keys))
        load = last == "load_N" or words[:2] == ("road", "loads_N")
        for pattern, usual in _PATTERNS:
            if len(pattern) == len(words) and all(
                p in ("*", w) for p, w in zip(pattern, words, strict=True)
            ):
                usual = _up_to_the_rim(usual, data, section) if load and section else usual
                if here == "rebar_layers" and last == "area_m2":
                    layer = _layer(table(table(data, here), str(keys[1])), section)
                    usual = layer.usual_area if layer else usual
                usual = _of_series(usual, data, keys, value)
                yield _of_material(usual, data, section, keys), ""


def _of_series(usual: Usual, data: CaseData, keys: Keys, value: float) -> Usual:
    """The range of a Prony term's number beside the other terms; of any other number, ``usual``."""
    if keys[0] != "materials" or keys[2] != "prony" or len(keys) != 5:
        return usual
    series = _value(data, keys[:3])
    terms = [term for term in series if isinstance(term, dict)] if isinstance(series, list) else []
    here = _value(data, keys[:4])
    others = (number(term, str(keys[4])) for term in terms if term is not here)
    return in_series(usual, str(keys[4]), value, [x for x in others if x is not None])


def _layer(layer: CaseData, section: Section | None) -> CordLayer | None:
    """A layer of the case; None where its cords are not stated, or at an angle to each other."""
    area, spacing = number(layer, "area_m2"), number(layer, "spacing_m")
    if section is None or not area or not spacing:
        return None
    return CordLayer(area, spacing, number(layer, "angle_deg") or 0.0, _angle(layer, section))


def _of_material(usual: Usual, data: CaseData, section: Section | None, keys: Keys) -> Usual:
    """The range of a material's number as its other numbers leave it; of any other, ``usual``."""
    if keys[0] != "materials" or len(keys) != 3:
        return usual
    name, key = str(keys[1]), keys[2]
    material = table(table(data, "materials"), name)
    if material.get("kind") == "rubber" and key == "density_kg_per_m3":
        return RUBBER_DENSITY
    if key == "youngs_modulus_Pa":
        own = (each for each in table(data, "rebar_layers").values() if isinstance(each, dict))
        layers = (_layer(each, section) for each in own if each.get("material") == name)
        return cord_modulus(number(material, "density_kg_per_m3"), filter(None, layers))
    if key in ("C10_Pa", "C01_Pa"):
        other = "C01_Pa" if key == "C10_Pa" else "C10_Pa"
        rest = number(material, other)
        if rest is not None and USUAL[f"materials.*.{other}"].holds(rest):
            return constant_beside(usual, 2.0, 2.0 * rest)
    return usual


def _up_to_the_rim(usual: Usual, data: CaseData, section: Section) -> Usual:
    """A load's range, up to what flattens the tyre to its rim: a patch as wide as the tyre and as
    long as the chord there, under the inflation pressure."""
    outer = section.points[-1]
    R, width = float(outer[:, 0].max()), 2 * float(abs(outer[:, 1]).max())
    h = R - float(outer[section.rigid, 0].max())
    kPa = number(data, "pressure_kPa")
    if kPa is None or not USUAL["pressure_kPa"].holds(kPa) or not 0 < h < R:
        return usual
    most = float(f"{1e3 * kPa * width * 2 * sqrt(2 * R * h - h * h):.2g}")
    if not usual.low < most < usual.high:
        return usual
    return replace(usual, high=most, reason=", the load at which this tyre bottoms on its rim")


def _angle(layer: CaseData, section: Section) -> Usual | None:
    """A layer's usual angle: of a carcass, from crown to bead, or of a belt, at the crown."""
    line = layer.get("line")
    if line not in section.names or layer.get("regions") is not None:
        return None
    there = section.points[section.names.index(line), :, 0]
    there = there == there  # NaN: the line is absent
    if there.all():
        return CARCASS_ANGLE
    return BELT_ANGLE if there[0] else None


def _numbers(part: Any, keys: Keys) -> Iterator[tuple[Keys, float]]:
    """All numbers in a part, and where they stand."""
    if isinstance(part, dict | list):
        for key, value in part.items() if isinstance(part, dict) else enumerate(part):
            yield from _numbers(value, (*keys, key))
    elif isinstance(part, int | float) and not isinstance(part, bool):
        yield keys, part


def _value(data: CaseData, keys: Keys) -> Any:
    """The value at ``keys``, which may be left to its default, or in what is wrong."""
    try:
        return at(data, keys)
    except (KeyError, TypeError):
        return None


def _keys(data: CaseData, path: str) -> Keys:
    """Keys to which a path leads; none where it is wrong, which is reported elsewhere."""
    effects = {**dict.fromkeys(IDS, 0.0), **table(data, "effects")}
    try:
        return find({**data, "effects": effects}, path)
    except KeyError:
        return ()
