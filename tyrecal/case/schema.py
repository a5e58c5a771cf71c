"""The case file as typed data; attributes are named as the file's keys, units as in the names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from ..effects import IDS
from .parts import WRONG, Degrees, Name, NotNegative, Part, Positive, Problem, Text, number

Moduli = Literal["long_term", "instantaneous"]
Element = Literal["CGAX8R", "CGAX8", "CGAX4R"]


class Gauge(Part):
    """A factor on the thickness between two lines, in some regions or in all."""

    between: Annotated[list[Text], Field(min_length=2, max_length=2)]
    regions: list[Text] | None = None
    factor: Annotated[float, Field(ge=0.1, le=10)]


class Outline(Part):
    """The outer and the inner curve (CSV), and what they do not show.

    ``belt_width_m``: of the wider belt, along the carcass; the rim holds what lies within
    ``rim_radius_m``. Depths: inner surface to carcass, to the first belt, to the second.
    """

    file: Text
    belt_width_m: Positive
    rim_radius_m: Positive
    carcass_depth_m: Positive = 1.2e-3
    belt_depth_m: Positive = 1.2e-3
    belt_spacing_m: Positive = 1.2e-3
    belt_step_m: Positive = 0.010


class SectionSource(Part):
    """``stations``: the station table, or ``outline``: two curves; CSV, relative to the case file.

    ``gauges`` scale it.
    """

    stations: Text | None = None
    outline: Outline | None = None
    gauges: list[Gauge] | None = None

    @property
    def file(self) -> str:
        """The CSV that the section is in."""
        return self.outline.file if self.outline else self.stations or ""

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Problem]:
        stations, outline = values.get("stations"), values.get("outline")
        if stations is None and outline is None:
            yield "stations", "must be given, or outline"
        elif stations is not None and outline is not None:
            yield "outline", "must be absent with stations"


class Level(Part):
    """A mesh: elements per region of the half section, rows per gap between two lines.

    ``grading``: thickness of a row over that of the row inside it, per gap.
    """

    elements: dict[Name, Annotated[int, Field(ge=1, le=200)]]
    rows: list[Annotated[int, Field(ge=1, le=20)]]
    grading: list[Annotated[float, Field(ge=0.1, le=10)]] | None = None


class Mesh(Part):
    """Element type and the mesh levels by name; ``level`` is the one in use."""

    element: Element
    level: str
    levels: Annotated[dict[Name, Level], Field(min_length=1)]
    hourglass_stiffness_Pa: Positive | None = None


class Prony(Part):
    """A term of the Prony series: shares of the shear and bulk modulus, relaxation time."""

    g: Annotated[float, Field(ge=0, lt=1)]
    k: Annotated[float, Field(ge=0, lt=1)]
    tau_s: Positive


class Rubber(Part):
    """Mooney-Rivlin: C10 (I1 - 3) + C01 (I2 - 3) + (J - 1)^2 / D1, with a Prony series.

    ``moduli`` says whether the constants are those of relaxed or of instantaneous rubber. In a
    mode of frequency f the shear modulus is (f / reference_frequency_Hz)^frequency_exponent times
    as large.
    """

    kind: Literal["rubber"]
    C10_Pa: float
    C01_Pa: float
    D1_per_Pa: Positive
    moduli: Moduli = "long_term"
    prony: list[Prony] = Field(default_factory=list)
    frequency_exponent: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    reference_frequency_Hz: Positive = 60.0
    density_kg_per_m3: Positive

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Problem]:
        c10, c01 = number(values, "C10_Pa"), number(values, "C01_Pa")
        if c10 is not None and c01 is not None and not c10 + c01 > 0:
            yield "C10_Pa", f"must be greater than -C01_Pa, C10_Pa + C01_Pa is {c10 + c01:g}"
        for share in "gk":
            terms = values.get("prony")
            terms = terms if isinstance(terms, list) else []
            total = sum(number(dict(term), share) or 0 for term in terms if term is not WRONG)
            if total >= 1:
                yield "prony", f"must have a sum of all {share} less than 1, got {total:g}"


class Cord(Part):
    """A linear elastic cord."""

    kind: Literal["cord"]
    youngs_modulus_Pa: Positive
    poissons_ratio: Annotated[float, Field(ge=0, lt=0.5)]
    density_kg_per_m3: Positive


class Solid(Part):
    """A material in the whole section, or only in ``regions`` and/or ``between`` two lines."""

    material: str
    regions: Annotated[list[str], Field(min_length=1)] | None = None
    between: Annotated[list[str], Field(min_length=2, max_length=2)] | None = None


class RebarLayer(Part):
    """Cords on a line of the section; ``angle_deg`` from the meridian, ``area_m2`` of one cord.

    Cords stand ``spacing_m`` apart or, with ``geometry: angular``, ``spacing_deg`` apart. The
    layer is as long as its line, or ends with some of its ``regions``.
    """

    line: str
    material: str
    area_m2: Positive
    geometry: Literal["constant", "angular"] = "constant"
    spacing_m: Positive | None = None
    spacing_deg: Annotated[float, Field(gt=0, le=360)] | None = None
    angle_deg: Degrees
    regions: Annotated[list[str], Field(min_length=1)] | None = None

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Problem]:
        geometry = values.get("geometry", "constant")
        pair = {"constant": ("spacing_m", "spacing_deg"), "angular": ("spacing_deg", "spacing_m")}
        if geometry in pair:
            needed, other = pair[geometry]
            if values.get(other) is not None:
                yield other, f"must be absent with geometry: {geometry}, which takes {needed}"
            if values.get(needed) is None:
                yield needed, f"must be given with geometry: {geometry}"


class Point(Part):
    """A point of the section's plane, m."""

    r: float
    z: float


def _values(part: Any) -> Mapping[str, Any]:
    """The values of a part, checked or as in the file; none where it is wrong."""
    if isinstance(part, Part):
        return part.__dict__
    return part if isinstance(part, Mapping) else {}


class Spindle(Part):
    """Compliance of what holds the wheel, at the rim's reference point; 0 = clamped."""

    lateral_m_per_N: NotNegative = 0.0
    radial_m_per_N: NotNegative = 0.0
    torsional_rad_per_N_m: NotNegative = 0.0
    tilt_rad_per_N_m: NotNegative = 0.0

    @property
    def gives_way(self) -> bool:
        """Whether the wheel moves on it."""
        return any(self.__dict__.values())


class Rim(Part):
    """The rigid rim; its reference point is the wheel's centre.

    In a vibration it moves on its ``spindle``, or is ``free``; its own mass and moments of
    inertia (polar: about the axle) are then those of wheel and hub, by default of steel, 17 inch.
    """

    reference_point_m: Point
    mass_kg: Positive = 15.0
    polar_inertia_kg_m2: Positive = 0.43
    diametral_inertia_kg_m2: Positive = 0.27
    spindle: Spindle = Spindle()
    free: bool = False

    @property
    def moves(self) -> bool:
        """Whether it moves in a vibration."""
        return self.free or self.spindle.gives_way

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Problem]:
        spindle, point = (_values(values.get(key)) for key in ("spindle", "reference_point_m"))
        soft, free = any(number(spindle, key) for key in spindle), values.get("free") is True
        if soft and free:
            yield "free", "must be false where the spindle has a compliance"
        r = number(point, "r")
        if (soft or free) and r:
            yield "reference_point_m", f"must have r = 0 where the rim moves, got {r:g}"


class Cavity(Part):
    """The gas in the tyre as it moves with the walls; ``share`` of its mass and stiffness, 0 =
    a constant pressure only, 1 = the gas as it is."""

    gas: Literal["air", "helium", "sulphur_hexafluoride"] = "air"
    temperature_C: Annotated[float, Field(gt=-100, lt=300)] = 20.0
    share: NotNegative = 0.0


class Analysis(Part):
    """What is computed: the inflation, then modes up to ``highest_harmonic``."""

    static_moduli: Moduli = "long_term"
    static_increments: Annotated[int, Field(ge=1, le=1000)] = 10
    vibration_frequency_Hz: Positive | None = None
    sectors: Annotated[int, Field(ge=8, le=1000)] = 60
    highest_harmonic: Annotated[int, Field(ge=0, le=20)] = 4
    modes_per_harmonic: Annotated[int, Field(ge=1, le=10)] = 2


class PointMass(Part):
    """A lumped mass on the tread, at the angle 0 and the height z over the middle."""

    mass_kg: NotNegative = 0.0
    z_m: float = 0.0


class RoadSpring(Part):
    """A road that barely touches: springs from the tread to the ground at the angle 0, over
    ``width_m`` about the middle; the deflection by the static load is left out."""

    radial_N_per_m: NotNegative = 0.0
    lateral_N_per_m: NotNegative = 0.0
    tangential_N_per_m: NotNegative = 0.0
    width_m: Positive = 0.08


class Splice(Part):
    """A sector about the angle 0 in which numbers of the case are larger by ``share`` of
    themselves: materials, layers and densities, but no geometry."""

    share: Annotated[float, Field(gt=-1, le=10)] = 0.0
    width_deg: Annotated[float, Field(gt=0, le=180)] = 10.0
    numbers: Annotated[list[Text], Field(min_length=1)] = Field(
        default_factory=lambda: ["materials.rubber.C10_Pa"]
    )


class Road(Part):
    """The flat, rigid road that a tyre is pressed on, and the mesh round the tyre for it.

    ``stiffness_Pa_per_m``: contact pressure over overclosure; ``elastic_slip_m``: slip before
    friction is full; ``element_angles_deg``: lengths from the patch's middle to the top.
    """

    friction: NotNegative = 0.5
    stiffness_Pa_per_m: Positive = 1e10
    elastic_slip_m: Annotated[float, Field(ge=1e-6)] = 1e-4
    element_angles_deg: Annotated[list[Positive], Field(min_length=1, max_length=200)] = Field(
        default_factory=lambda: [4.0] * 3 + [5.0, 8.0, 17.0, 45.0, 93.0]
    )
    loads_N: Annotated[list[Positive], Field(min_length=1, max_length=100)] = Field(
        default_factory=lambda: [500.0, *(1000.0 * kN for kN in (1, 2, 3, 4, 5, 6, 8))]
    )

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Problem]:
        angles, loads = _numbers(values, "element_angles_deg"), _numbers(values, "loads_N")
        if angles and abs(sum(angles) - 180) > 1e-6:
            yield "element_angles_deg", f"must have the sum 180, got {sum(angles):g}"
        if any(after <= before for before, after in pairwise(loads)):
            yield "loads_N", "must rise from one to the next"


def _numbers(values: Mapping[str, Any], key: str) -> list[float]:
    """The list at ``key``; empty where there is none, or one with a wrong entry."""
    value = values.get(key)
    right = isinstance(value, list) and all(isinstance(x, int | float) for x in value)
    return value if right and value else []


class Variable(Part):
    """A design variable: the numbers it sets (dotted paths), its start and its bounds."""

    sets: Annotated[list[str], Field(min_length=1)]
    start: float
    lower: float
    upper: float
    scale: Literal["log", "linear"] = "log"

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Problem]:
        start, lower, upper = (number(values, key) for key in ("start", "lower", "upper"))
        if lower is not None and upper is not None and not lower < upper:
            yield "upper", f"must be greater than lower, {lower:g}"
        elif start is not None and lower is not None and start < lower:
            yield "start", f"must be at least lower, {lower:g}"
        elif start is not None and upper is not None and start > upper:
            yield "start", f"must be at most upper, {upper:g}"
        if lower is not None and lower <= 0 and values.get("scale", "log") == "log":
            yield "lower", "must be greater than 0, or the variable needs scale: linear"


class TargetMode(Part):
    """A measured mode [c, m]; ``kind`` tells the two [0, 0] apart; ``sigma_Hz``, its standard
    deviation, counts as 1 Hz where it is not known."""

    c: Annotated[int, Field(ge=0, le=20)]
    m: Annotated[int, Field(ge=0, le=3)]  # beyond, the belt's motion has no clear order
    kind: Literal["axial", "torsional"] | None = None
    frequency_Hz: Positive
    weight: NotNegative = 1.0
    sigma_Hz: Positive | None = None

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Problem]:
        c, m, kind = number(values, "c"), number(values, "m"), values.get("kind")
        if c is None or m is None:
            return
        if c == m == 0 and kind is None:
            yield "kind", "must be axial or torsional for the mode [0,0]"
        if (c or m) and kind is not None:
            yield "kind", f"must be absent: only [0,0] has a kind, this mode is [{c},{m}]"


MEASURED = {"contact_area_m2": "sigma_m2", "vertical_stiffness_N_per_m": "sigma_N_per_m"}
"""What a footprint target can hold, and the key of its standard deviation."""


class TargetFootprint(Part):
    """A measured contact area, or tangent vertical stiffness, at a load, with its sigma."""

    load_N: Positive
    contact_area_m2: Positive | None = None
    sigma_m2: Positive | None = None
    vertical_stiffness_N_per_m: Positive | None = None
    sigma_N_per_m: Positive | None = None
    weight: NotNegative = 1.0

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Problem]:
        given = [key for key in MEASURED if values.get(key) is not None]
        if not given and WRONG in values.values():  # a misspelt key, which is reported
            return
        if not given:
            both = " or ".join(MEASURED)
            yield "load_N", f"must come with what was measured at this load, {both}"
        elif len(given) > 1:
            yield given[1], f"must be a target of its own: this one holds {given[0]} already"
        else:
            for key, sigma in MEASURED.items():
                if key in given and values.get(sigma) is None:
                    yield sigma, f"must be given: the standard deviation of {key}, in its unit"
                if key not in given and values.get(sigma) is not None:
                    yield sigma, f"must be absent: it is of {key}, this target is {given[0]}"


class Targets(Part):
    """What was measured, and where it comes from."""

    source: Text = ""
    modes: list[TargetMode] = Field(default_factory=list)
    footprint: list[TargetFootprint] = Field(default_factory=list)


class Uncertainty(Part):
    """A source of error: numbers nobody calibrates, all off together by a standard deviation.

    ``percent`` of each number or ``absolute``, in its unit; ``signs``: -1 for those that fall
    where the others rise.
    """

    sets: Annotated[list[Text], Field(min_length=1)]
    percent: Positive | None = None
    absolute: Positive | None = None
    signs: list[Annotated[int, Field(ge=-1, le=1)]] | None = None

    @classmethod
    def problems(cls, values: Mapping[str, Any]) -> Iterator[Problem]:
        percent, absolute = values.get("percent"), values.get("absolute")
        if percent is None and absolute is None:
            yield "percent", "must be given, or absolute"
        elif percent is not None and absolute is not None:
            yield "absolute", "must be absent with percent"
        sets, signs = values.get("sets"), values.get("signs")
        if isinstance(sets, list) and isinstance(signs, list) and len(signs) != len(sets):
            yield "signs", f"must have {len(sets)} entries, one for each of sets"


class Solver(Part):
    """Which solver runs, how long one run (of footprints: a load) may take, its own options."""

    name: Name
    time_limit_s: Positive
    options: dict[str, Any] = Field(default_factory=dict)


def _every_effect(given: dict[str, float]) -> dict[str, float]:
    """Those not given are absent: 0."""
    return {**dict.fromkeys(IDS, 0.0), **given}


class Case(Part):
    """One tyre, its mesh and analysis, what may vary and what was measured.

    ``spin_rad_per_s``: the tyre turns about its axle, not touching a road. ``effects``: parameters
    of effects that are in it, by id, in the effect's unit.
    """

    format: Annotated[int, Field(ge=1, le=1)]  # Literal[1] would take true
    name: Text
    size: Text
    pressure_kPa: Annotated[float, Field(ge=0, lt=2000)]
    section: SectionSource
    mesh: Mesh
    materials: Annotated[
        dict[Name, Annotated[Rubber | Cord, Field(discriminator="kind")]], Field(min_length=1)
    ]
    solids: Annotated[list[Solid], Field(min_length=1)]
    rebar_layers: dict[Name, RebarLayer] = Field(default_factory=dict)
    rim: Rim
    cavity: Cavity = Cavity()
    spin_rad_per_s: NotNegative = 0.0
    point_mass: PointMass = PointMass()
    road_spring: RoadSpring = RoadSpring()
    splice: Splice = Splice()
    analysis: Analysis
    road: Road = Road()
    effects: Annotated[dict[str, float], AfterValidator(_every_effect)] = Field(
        default_factory=lambda: dict.fromkeys(IDS, 0.0)
    )
    variables: dict[Name, Variable] = Field(default_factory=dict)
    targets: Targets = Targets()
    uncertainties: dict[Name, Uncertainty] = Field(default_factory=dict)
    solver: Solver
    templates: Text | None = None

    @property
    def loads_N(self) -> list[float]:
        """Loads at which the tyre is pressed, rising: the road's and those with a target."""
        return sorted({*self.road.loads_N, *(target.load_N for target in self.targets.footprint)})
