"""The parts of a tyre as a case file holds them: materials, section, wheel, what is not uniform;
before them the kinds of number and text, and the model, that all parts of a case share.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    model_validator,
)
from pydantic_core import PydanticCustomError

from .mistakes import CaseData, shortened

LEAST, LARGEST = 1e-30, 1e15  # beyond, products of numbers leave what a computer holds
Moduli = Literal["long_term", "instantaneous"]
MAX_RELAXED = 0.999  # of a modulus: what is left must be a tyre's
Element = Literal["CGAX8R", "CGAX8", "CGAX4R"]
WHOLE_BEAD: Literal["whole_bead"] = "whole_bead"
RimSupport = Literal["fixed", "springs", "free"]


def _can_be_computed_with(value: float) -> float:
    if value and not LEAST <= abs(value) <= LARGEST:
        raise PydanticCustomError("size", f"must be 0, or from {LEAST:g} to {LARGEST:g} in size")
    return value


Number = Annotated[float, AfterValidator(_can_be_computed_with)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Frequency = Annotated[Positive, Field(ge=1e-3, le=1e5)]  # Hz
Degrees = Annotated[float, Field(ge=-180, le=180)]
# names end in decks, paths of keys and file names: one word of plain letters is safe in all
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_\-]*$", max_length=60)]
# Besides control characters, the marks that turn the direction of text: they make a name look like
# another one.
NOT_IN_TEXT = r"\x00-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069"
Text = Annotated[str, StringConstraints(pattern=rf"^[^{NOT_IN_TEXT}]*$", max_length=300)]
Setting = float | bool | str | None
"""A value that a user sets: a number, true or false, a word that the schema lists, null."""
Disagreement = tuple[str, str]
"""A key of a part, and what would be right there."""
MAX_REPR = 300
"""Characters of a part in Python."""
WRONG = object()
"""Stands in a part's values for one that is already reported."""


def as_written(value: Setting) -> str:
    """A number, true, false, null or a word, as a case file writes it."""
    if value is None or isinstance(value, str):
        return value or "null"
    return str(value).lower() if isinstance(value, bool) else f"{value:g}"


def number(values: CaseData, key: str) -> float | None:
    """The number at ``key``; None where there is none, or a wrong one."""
    value = values.get(key)
    return value if isinstance(value, int | float) else None


def one_of(values: CaseData, first: str, second: str) -> Iterator[Disagreement]:
    """Disagreement where not exactly one of two keys is given."""
    if values.get(first) is None and values.get(second) is None:
        yield first, f"must be given, or {second}"
    elif values.get(first) is not None and values.get(second) is not None:
        yield second, f"must be absent with {first}"


class Part(BaseModel):
    """A part of the case: known keys only, text is never a number, every number finite."""

    model_config = ConfigDict(
        extra="forbid", strict=True, allow_inf_nan=False, frozen=True, defer_build=True
    )

    def __repr__(self) -> str:
        return shortened(super().__repr__(), MAX_REPR)

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        """Disagreements between the keys of ``values``; those that are WRONG are not judged."""
        yield from ()

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        for key, message in self.problems(self.__dict__):
            raise PydanticCustomError("disagree", "{message}", {"key": key, "message": message})
        return self


class Prony(Part):
    """A term of the Prony series: shares of the shear and bulk modulus, relaxation time."""

    g: Annotated[float, Field(ge=0, lt=1)]  # share of the shear modulus that relaxes
    k: Annotated[float, Field(ge=0, lt=1)]  # share of the bulk modulus that relaxes
    tau_s: Annotated[Positive, Field(ge=1e-9, le=1e9)]  # relaxation time


LossRow = Annotated[list[NotNegative], Field(min_length=2, max_length=2)]  # Hz, loss factor
NUMBER_OR_TABLE = "number", "table"
Loss = Annotated[
    Annotated[NotNegative, Tag("number")]
    | Annotated[list[LossRow], Field(min_length=2), Tag("table")],
    Discriminator(lambda value: NUMBER_OR_TABLE[isinstance(value, list)]),
]


class Rubber(Part):
    """Mooney-Rivlin: C10 (I1 - 3) + C01 (I2 - 3) + (J - 1)^2 / D1, with a Prony series; its loss
    factor changes no frequency."""

    kind: Literal["rubber"]  # kind of material
    C10_Pa: Number  # first constant of Mooney-Rivlin's law
    C01_Pa: Number  # second constant of Mooney-Rivlin's law
    D1_per_Pa: Positive  # 2 over the bulk modulus
    # whether the constants are those of relaxed or of instantaneous rubber
    moduli: Moduli = "long_term"
    prony: list[Prony] = Field(default_factory=list)  # terms of the Prony series
    # n: in a mode of frequency f the shear modulus is × (f / reference_frequency_Hz)ⁿ
    frequency_exponent: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    # frequency at which the constants hold, if there is an exponent
    reference_frequency_Hz: Frequency = 60.0
    # loss over storage modulus in vibrations: a number, or rows [Hz, loss factor]; absent:
    # unknown
    loss_factor: Loss | None = None
    density_kg_per_m3: Positive  # density

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        c10, c01 = number(values, "C10_Pa"), number(values, "C01_Pa")
        if c10 is not None and c01 is not None and not c10 + c01 > 0:
            yield "C10_Pa", f"must be greater than -C01_Pa, C10_Pa + C01_Pa is {c10 + c01:g}"
        terms = values.get("prony")
        terms = terms if isinstance(terms, list) else []
        for share in "gk":
            total = sum(number(dict(term), share) or 0 for term in terms if term is not WRONG)
            if total > MAX_RELAXED:
                least = f"must have a sum of all {share} of at most {MAX_RELAXED:g}"
                yield "prony", f"{least}, got {total:.9g}"
        table = values.get("loss_factor")
        if isinstance(table, list):
            hertz = [row[0] for row in table if row is not WRONG and WRONG not in row]
            if any(b <= a for a, b in pairwise([0.0, *hertz])):
                yield (
                    "loss_factor",
                    "must have rows [Hz, loss factor], their frequencies rising from above 0",
                )
            if any(number(dict(term), "k") for term in terms if term is not WRONG):
                yield "loss_factor", "must be one number where a term of prony has a k above 0"


class Cord(Part):
    """A linear elastic cord; one that does not bear compression goes slack."""

    kind: Literal["cord"]  # kind of material
    youngs_modulus_Pa: Positive  # Young's modulus
    poissons_ratio: Annotated[float, Field(ge=0, lt=0.5)]  # Poisson's ratio
    density_kg_per_m3: Positive  # density
    bears_compression: bool = True  # false: the cord is slack if compressed


class Gauge(Part):
    """A factor on the thickness between two lines, in some regions or in all."""

    # inner and outer line of the section
    between: Annotated[list[Text], Field(min_length=2, max_length=2)]
    regions: list[Text] | None = None  # regions of the section; absent: all
    factor: Annotated[float, Field(ge=0.1, le=10)]  # factor on the thickness


class Outline(Part):
    """The outer and the inner curve (CSV), and what they do not show."""

    file: Text  # outer and inner curve, CSV, relative to the case file
    belt_width_m: Positive  # width of the wider belt, along the carcass
    rim_radius_m: Positive  # the rim holds what is within this radius
    carcass_depth_m: Positive = 1.2e-3  # from the inner surface to the carcass
    belt_depth_m: Positive = 1.2e-3  # from the carcass to the first belt
    belt_spacing_m: Positive = 1.2e-3  # from the first belt to the second
    belt_step_m: Positive = 0.010  # how much narrower the second belt is


# exact: of data that were computed with this very section
SectionOrigin = Literal["exact", "measured", "drawing", "size_code"]


class SectionSource(Part):
    """Source of the section: a station table, or an outline of two curves."""

    stations: Text | None = None  # station table, CSV, relative to the case file
    outline: Outline | None = None  # instead of stations: two curves
    gauges: list[Gauge] | None = None  # factors on thicknesses
    # how well the section is known, which gives its errors; absent: drawing
    known_from: SectionOrigin | None = None

    @property
    def file(self) -> str:
        """The CSV that the section is in."""
        return self.outline.file if self.outline else self.stations or ""

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        if any(values.get(key) is not None for key in cls.model_fields):  # else there is a deck
            yield from one_of(values, "stations", "outline")


DeckPart = Literal["tread", "sidewall", "bead_filler", "belts"]


class DeckGauges(Part):
    """Factors on the thickness of the deck's parts, from what they lie on to their free surface."""

    tread: Positive = 1.0  # factor on the thickness of the tread
    sidewall: Positive = 1.0  # factor on the thickness of the sidewall


class DeckSource(Part):
    """A user's ABAQUS deck of the section, or decks of the whole tyre in three dimensions."""

    file: Text | None = None  # deck of the section, relative to the case file
    # instead of file: decks in three dimensions, in the order in which they are run
    decks: Annotated[list[Text], Field(min_length=1, max_length=20)] | None = None
    units: Literal["m", "mm"]  # unit of length: m with kg, s, Pa; mm with t, s, MPa
    # node set of the outer surface over the belt; in three dimensions all round
    crown: Text = "CROWN"
    # element sets that are the tread, the sidewall, the bead filler, the belts, for effects
    parts: dict[DeckPart, list[Text]] = Field(default_factory=dict)
    gauges: DeckGauges = DeckGauges()  # factors on the thickness of parts
    # numbers of the deck by mark or path, in its own units; absent ones are as in the deck
    numbers: dict[Text, Number] = Field(default_factory=dict)

    def sets(self, part: str) -> list[str]:
        """Sets of a part, as decks compare names; none where it is not named."""
        return [name.upper() for key, names in self.parts.items() if key == part for name in names]

    @property
    def thickened(self) -> tuple[tuple[tuple[str, ...], float], ...]:
        """Sets of the parts that are not as thick as drawn, each with its factor."""
        factors = {"tread": self.gauges.tread, "sidewall": self.gauges.sidewall}
        return tuple((tuple(self.sets(part)), f) for part, f in factors.items() if f != 1)

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        yield from one_of(values, "file", "decks")
        gauges, parts = values.get("gauges"), values.get("parts")
        for key, given in (("parts", parts), ("gauges", gauges)):
            if values.get("decks") is not None and given not in (None, {}, DeckGauges()):
                yield key, "must be absent with decks"
        if isinstance(gauges, DeckGauges) and isinstance(parts, dict):
            for part, factor in gauges:
                if factor != 1 and not parts.get(part):
                    yield "gauges", f"needs the sets of {part}: name them in deck.parts.{part}"


class Level(Part):
    """A mesh: elements per region of the half section, rows per gap between two lines."""

    # elements along each region of the half section
    elements: dict[Name, Annotated[int, Field(ge=1, le=200)]]
    rows: list[Annotated[int, Field(ge=1, le=20)]]  # rows of elements between each two lines
    # thickness of a row over that of the row inside it, for each two lines
    grading: list[Annotated[float, Field(ge=0.1, le=10)]] | None = None


class Mesh(Part):
    """Element type and the mesh levels by name; ``level`` is the one in use."""

    element: Element  # type of the solid elements; CGAX4R is the paper's
    level: str  # the mesh in use; --mesh NAME chooses another
    levels: Annotated[dict[Name, Level], Field(min_length=1)]  # meshes by name
    # hourglass stiffness of CGAX4R; absent: 0.005 times the shear modulus
    hourglass_stiffness_Pa: Positive | None = None


class Solid(Part):
    """A material in the whole section, or only in ``regions`` and/or ``between`` two lines."""

    material: str  # name of a rubber; later entries override earlier ones
    # regions of the section; absent: all
    regions: Annotated[list[str], Field(min_length=1)] | None = None
    # inner and outer line; absent: the whole thickness
    between: Annotated[list[str], Field(min_length=2, max_length=2)] | None = None


# angles of cords count from the meridian, which runs from -z to +z, towards Theta
class RebarLayer(Part):
    """Cords on a line of the section, as long as the line, or in some of its ``regions``."""

    line: str  # line of the section
    material: str  # name of a cord
    area_m2: Positive  # cross-section of one cord
    # constant spacing, or fanned cords, whose spacing is an angle
    geometry: Literal["constant", "angular"] = "constant"
    spacing_m: Positive | None = None  # distance of two cords, with geometry: constant
    # angle between two cords about the axle, with geometry: angular
    spacing_deg: Annotated[float, Field(gt=0, le=360)] | None = None
    angle_deg: Degrees  # angle from the meridian
    # regions that have the layer; absent: all of its line
    regions: Annotated[list[str], Field(min_length=1)] | None = None

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        geometry = values.get("geometry", "constant")
        pair = {"constant": ("spacing_m", "spacing_deg"), "angular": ("spacing_deg", "spacing_m")}
        if geometry in pair:
            needed, other = pair[geometry]
            if values.get(other) is not None:
                yield other, f"must be absent with geometry: {geometry}, which takes {needed}"
            if values.get(needed) is None:
                yield needed, f"must be given with geometry: {geometry}"


class ReferencePoint(Part):
    """A point of the section's plane, m."""

    r: Number  # radial, from the axle
    z: Number  # along the axle


def part_values(part: Any) -> CaseData:
    """The values of a part, checked or as in the file; none where it is wrong."""
    if isinstance(part, Part):
        return part.__dict__
    return part if isinstance(part, Mapping) else {}


class Spindle(Part):
    """Compliance of what holds the wheel, at the rim's reference point; 0 = clamped."""

    lateral_m_per_N: NotNegative = 0.0  # compliance along the axle
    radial_m_per_N: NotNegative = 0.0  # compliance across the axle
    torsional_rad_per_N_m: NotNegative = 0.0  # compliance about the axle
    tilt_rad_per_N_m: NotNegative = 0.0  # compliance about a diameter

    @property
    def gives_way(self) -> bool:
        """Whether the wheel moves on it."""
        return any(self.__dict__.values())


class Rim(Part):
    """The rigid rim; its reference point is the wheel's centre.

    Where the section's stations say so it holds the bead through its whole thickness, or the
    surface of it that touches the rim: its outside and its end. In a vibration it moves on its
    ``spindle``, or is ``free``; its own mass and moments of inertia (polar: about the axle) are
    then those of wheel and hub, by default of steel, 17 inch.
    """

    reference_point_m: ReferencePoint  # wheel centre
    # whole_bead, or its surface: outside and end of the bead
    holds: Literal["whole_bead", "bead_surface"] = WHOLE_BEAD
    mass_kg: Positive = 15.0  # mass of wheel and hub, if the rim moves
    polar_inertia_kg_m2: Positive = 0.43  # moment of inertia about the axle, if the rim moves
    diametral_inertia_kg_m2: Positive = 0.27  # moment of inertia about a diameter, if the rim moves
    spindle: Spindle = Spindle()  # compliances of the wheel's support in vibrations
    free: bool = False  # true: the wheel is free in vibrations

    @property
    def holds_whole_bead(self) -> bool:
        """Whether it holds a bead through its thickness."""
        return self.holds == WHOLE_BEAD

    @property
    def moves(self) -> bool:
        """Whether it moves in a vibration."""
        return self.free or self.spindle.gives_way

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        spindle, point = (part_values(values.get(key)) for key in ("spindle", "reference_point_m"))
        soft, free = any(number(spindle, key) for key in spindle), values.get("free") is True
        if soft and free:
            yield "free", "must be false where the spindle has a compliance"
        r = number(point, "r")
        if (soft or free) and r:
            yield "reference_point_m", f"must have r = 0 where the rim moves, got {r:g}"


class Cavity(Part):
    """The gas in the tyre as it moves with the walls; ``share`` of its mass and stiffness, 0 =
    a constant pressure only, 1 = the gas as it is."""

    gas: Literal["air", "helium", "sulphur_hexafluoride"] = "air"  # gas in the tyre
    temperature_C: Annotated[float, Field(gt=-100, lt=300)] = 20.0  # temperature of the gas
    # share of the gas that vibrates; 1: all of it
    share: Annotated[NotNegative, Field(le=100)] = 0.0


class PointMass(Part):
    """A lumped mass on the tread, at the angle 0 and the height z over the middle."""

    mass_kg: NotNegative = 0.0  # lumped mass on the tread at angle 0
    z_m: Number = 0.0  # distance from the middle of the tread


class RoadSpring(Part):
    """A road that barely touches: springs from the tread to the ground at the angle 0, over
    ``width_m`` about the middle; the deflection by the static load is left out."""

    radial_N_per_m: NotNegative = 0.0  # stiffness along the radius
    lateral_N_per_m: NotNegative = 0.0  # stiffness along the axle
    tangential_N_per_m: NotNegative = 0.0  # stiffness along the circumference
    width_m: Positive = 0.08  # width of the tread over which the springs are spread

    @property
    def stiffnesses(self) -> dict[str, float]:
        """Stiffnesses that are there, N/m, by direction."""
        named = {
            "radial": self.radial_N_per_m,
            "lateral": self.lateral_N_per_m,
            "tangential": self.tangential_N_per_m,
        }
        return {direction: stiffness for direction, stiffness in named.items() if stiffness}


class Splice(Part):
    """A sector about the angle 0 in which numbers of the case are larger by ``share`` of
    themselves: materials, layers and densities, but no geometry."""

    share: Annotated[float, Field(gt=-1, le=10)] = 0.0  # the numbers are multiplied by 1 + share
    width_deg: Annotated[float, Field(gt=0, le=180)] = 10.0  # width of the sector about angle 0
    # paths of materials, layers and densities
    numbers: Annotated[list[Text], Field(min_length=1)] = Field(
        default_factory=lambda: ["materials.rubber.C10_Pa"]
    )
