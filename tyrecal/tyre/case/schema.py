"""The case file as typed data: attributes are named as the file's keys, units as in the names.

What the tyre is made of stands in `parts`; here is what is computed, what may vary, what was
measured, and the whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field

from ..footprint_quantities import FOOTPRINT_QUANTITIES
from ..plugins import IDS
from .mistakes import CaseData
from .parts import (
    WHOLE_BEAD,
    WRONG,
    Cavity,
    Cord,
    DeckSource,
    Disagreement,
    Frequency,
    Level,
    Mesh,
    Moduli,
    Name,
    NotNegative,
    Number,
    Part,
    PointMass,
    Positive,
    RebarLayer,
    Rim,
    RimSupport,
    RoadSpring,
    Rubber,
    SectionSource,
    Solid,
    Splice,
    Text,
    number,
    one_of,
    part_values,
)

MIN_CASE_LOAD_N, MAX_CASE_LOAD_N = 1.0, 1e6  # outside, no tyre finds its balance on a road
Load = Annotated[Positive, Field(ge=MIN_CASE_LOAD_N, le=MAX_CASE_LOAD_N)]
Weight = Annotated[NotNegative, Field(le=1e6)]
Pressure = Annotated[Number, Field(ge=0, lt=2000)]  # kPa


class Analysis(Part):
    """Steps of the computation: the inflation, then modes up to ``highest_harmonic``."""

    static_moduli: Moduli = "long_term"  # moduli of the rubber in the inflation
    # increments of the inflation in the decks
    static_increments: Annotated[int, Field(ge=1, le=1000)] = 10
    # frequency of the Prony series in vibrations; absent: moduli of the inflation
    vibration_frequency_Hz: Frequency | None = None
    sectors: Annotated[int, Field(ge=8, le=1000)] = 60  # sectors of the revolved tyre in the decks
    # modes are computed up to this number of waves
    highest_harmonic: Annotated[int, Field(ge=0, le=20)] = 4
    modes_per_harmonic: Annotated[int, Field(ge=1, le=10)] = 2  # modes for each number of waves


class Road(Part):
    """The flat, rigid road that a tyre is pressed on, and the mesh round the tyre for it."""

    friction: NotNegative = 0.5  # friction coefficient
    stiffness_Pa_per_m: Positive = 1e9  # contact pressure over overclosure
    elastic_slip_m: Annotated[float, Field(ge=1e-6)] = 1e-4  # slip before friction is full
    # wheel's centre in vibrations: held, or free along the load with the rim's mass
    wheel: Literal["held", "free_along_load"] = "held"
    # lengths of the elements round half the tyre, from the patch to the top, sum 180
    element_angles_deg: Annotated[list[Positive], Field(min_length=1, max_length=200)] = Field(
        default_factory=lambda: [4.0] * 3 + [5.0, 8.0, 17.0, 45.0, 93.0]
    )
    # loads on the road, rising
    loads_N: Annotated[list[Load], Field(min_length=1, max_length=100)] = Field(
        default_factory=lambda: [500.0, *(1000.0 * kN for kN in (1, 2, 3, 4, 5, 6, 8))]
    )

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        angles, loads = _numbers(values, "element_angles_deg"), _numbers(values, "loads_N")
        if angles and abs(sum(angles) - 180) > 1e-6:
            yield "element_angles_deg", f"must have the sum 180, got {sum(angles):g}"
        if any(after <= before for before, after in pairwise(loads)):
            yield "loads_N", "must rise from one to the next"


def _numbers(values: CaseData, key: str) -> list[float]:
    """The list at ``key``; empty where there is none, or one with a wrong entry."""
    value = values.get(key)
    right = isinstance(value, list) and all(isinstance(x, int | float) for x in value)
    return value if right and value else []


class SolverChoice(Part):
    """The solver to run, how long one run may take, its own options."""

    name: Name  # bundled, calculix, abaqus or your own
    time_limit_s: Positive  # limit of one run, on the road of one load; bundled: processor time
    options: dict[str, Any] = Field(default_factory=dict)  # the solver's own options


def cannot_fit(weights: Sequence[float], free: int) -> str | None:
    """Why targets of these weights are none to fit ``free`` variables to; None where they are."""
    count = sum(weight > 0 for weight in weights)
    if not count:
        return "every target has the weight 0: there is nothing to fit to"
    if count < free:
        targets = "1 target" if count == 1 else f"{count} targets"
        return (
            f"{targets} cannot determine {free} free variables: give more, hold variables with"
            " --fix, or weigh in what is known with --prior"
        )
    return None


class Variable(Part):
    """A design variable: the numbers that it sets, its start and how well that is known, bounds."""

    # paths of the numbers that have the variable's value
    sets: Annotated[list[str], Field(min_length=1)]
    start: Number  # value at the start; it overrides the values at the paths
    lower: Number  # least value
    upper: Number  # largest value
    # standard deviation of the start in percent; absent: 0.5 of its logarithm, linear: uniform
    percent: Positive | None = None
    scale: Literal["log", "linear"] = "log"  # how a fit takes steps

    @property
    def sd(self) -> float | None:
        """Standard deviation of the start in the variable's own unit, None if it is in percent."""
        return None

    def numbers(self, value: float) -> list[float]:
        """The numbers at ``sets`` where the variable has a value."""
        return [value] * len(self.sets)

    def with_copies(self, copies: Callable[[str], Sequence[str]]) -> Self:
        """The variable that sets each of its numbers and the copies of it, by path."""
        sets = [each for path in self.sets for each in (path, *copies(path))]
        return self.model_copy(update={"sets": sets})

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
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
    """A measured mode [c, m] in its state, by default the case's: pressure, rim, load."""

    c: Annotated[int, Field(ge=0, le=20)]  # waves round the circumference
    m: Annotated[int, Field(ge=0, le=3)]  # nodal circles on the belt
    kind: Literal["axial", "torsional"] | None = None  # only of [0,0]: axial (lateral) or torsional
    frequency_Hz: Frequency  # frequency
    weight: Weight = 1.0  # weight in the objective
    # standard deviation; absent: counts as 1 Hz; required under a load
    sigma_Hz: Positive | None = None
    damping_ratio: Positive | None = None  # fraction of critical; fitted by loss factors alone
    damping_sigma: Positive | None = None  # standard deviation of damping_ratio; absent: 25 %
    pressure_kPa: Pressure | None = None  # pressure at which it was measured; absent: the case's
    rim: RimSupport | None = None  # how the rim was held; absent: as in the case
    load_N: Load | None = None  # load on the road
    # symmetry about the patch, of a mode under a load
    symmetry: Literal["symmetric", "antisymmetric"] | None = None

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        c, m, kind = number(values, "c"), number(values, "m"), values.get("kind")
        if c is None or m is None:
            return
        if c == m == 0 and kind is None:
            yield "kind", "must be axial (lateral) or torsional for the mode [0,0]"
        if (c or m) and kind is not None:
            yield "kind", f"must be absent: only [0,0] has a kind, this mode is [{c},{m}]"
        loaded = [key for key in ("load_N", "symmetry") if values.get(key) is not None]
        if loaded == ["load_N"]:
            yield "symmetry", "must be symmetric or antisymmetric (about the patch) under load_N"
        elif loaded == ["symmetry"]:
            yield "symmetry", "must be absent without load_N"
        if values.get("damping_sigma") is not None and values.get("damping_ratio") is None:
            yield "damping_sigma", "must be absent without damping_ratio"
        if "load_N" in loaded and values.get("sigma_Hz") is None:
            yield "sigma_Hz", "must be given for a mode under load_N"


class TargetFootprint(Part):
    """A measured contact area, length or width, or tangent vertical stiffness, at a load, with its
    sigma; its pressure, by default the case's."""

    load_N: Load  # load on the road
    pressure_kPa: Pressure | None = None  # pressure at which it was measured; absent: the case's
    contact_area_m2: Positive | None = None  # area of the patch
    sigma_m2: Positive | None = None  # standard deviation of the area
    # largest extent of the patch along the rolling direction
    contact_length_m: Positive | None = None
    # largest extent of the patch across the rolling direction
    contact_width_m: Positive | None = None
    sigma_m: Positive | None = None  # standard deviation of length or width
    vertical_stiffness_N_per_m: Positive | None = None  # tangent at the load
    sigma_N_per_m: Positive | None = None  # standard deviation of the stiffness
    weight: Weight = 1.0  # weight in the objective

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        given = [key for key in FOOTPRINT_QUANTITIES if values.get(key) is not None]
        if not given and WRONG in values.values():  # a misspelt key, which is reported
            return
        if not given:
            every = " or ".join(FOOTPRINT_QUANTITIES)
            yield "load_N", f"must come with what was measured at this load, {every}"
        elif len(given) > 1:
            yield given[1], f"must be a separate target: this one holds {given[0]} already"
        else:
            own = FOOTPRINT_QUANTITIES[given[0]].sigma
            if values.get(own) is None:
                yield own, f"must be given: the standard deviation of {given[0]}, in its unit"
            for key, quantity in FOOTPRINT_QUANTITIES.items():
                if quantity.sigma != own and values.get(quantity.sigma) is not None:
                    words = f"must be absent: it is of {key}, this target is {given[0]}"
                    yield quantity.sigma, words


class TargetMass(Part):
    """The measured mass of the tyre without its rim, with its sigma."""

    mass_kg: Positive  # mass of the tyre without its rim
    sigma_kg: Positive  # standard deviation of the mass
    weight: Weight = 1.0  # weight in the objective


class Targets(Part):
    """Measured values and their source; ``file``: a measurements CSV that holds it."""

    source: Text = ""  # where the values are from
    file: Text | None = None  # instead of the keys below: a measurements CSV in the case's folder
    # measured modes; pairs once, they count twice
    modes: list[TargetMode] = Field(default_factory=list)
    # measured quantities on the road
    footprint: list[TargetFootprint] = Field(default_factory=list)
    mass: TargetMass | None = None  # measured mass

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        if values.get("file") is not None:
            for key in ("modes", "footprint", "mass"):
                if values.get(key):
                    yield key, "must be absent with file, which holds what was measured"

    @property
    def loads_N(self) -> list[float]:
        """Loads at which something was measured, rising."""
        modal = {mode.load_N for mode in self.modes if mode.load_N}
        return sorted(modal | {target.load_N for target in self.footprint})

    @property
    def weights(self) -> list[float]:
        """The weight of each."""
        mass = [self.mass.weight] if self.mass else []
        return [t.weight for t in self.modes] + [t.weight for t in self.footprint] + mass


class Uncertainty(Part):
    """A source of error: uncalibrated numbers, all off together by a standard deviation."""

    sets: Annotated[list[Text], Field(min_length=1)]  # paths of numbers that are off together
    percent: Positive | None = None  # standard deviation in percent of each number
    # instead of percent: standard deviation in the numbers' unit
    absolute: Positive | None = None
    # -1 for numbers that fall where the others rise
    signs: list[Annotated[int, Field(ge=-1, le=1)]] | None = None

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        yield from one_of(values, "percent", "absolute")
        sets, signs = values.get("sets"), values.get("signs")
        if isinstance(sets, list) and isinstance(signs, list) and len(signs) != len(sets):
            yield "signs", f"must have {len(sets)} entries, one for each of sets"


def _every_effect(given: dict[str, float]) -> dict[str, float]:
    """Effects of a case with those not given: they are absent, 0."""
    return {**dict.fromkeys(IDS, 0.0), **given}


OF_A_SECTION = ("section", "mesh", "materials", "solids")
"""Keys that a case must have, if it has no deck."""
IN_A_DECK = ("section", "mesh", "materials", "solids", "rebar_layers", "templates")
"""Keys that a case with a deck must not have: the deck has these numbers."""
IN_DECKS = ("cavity", "spin_rad_per_s", "point_mass", "road_spring", "splice")
"""Keys that a case with decks in three dimensions must not have either."""
HIGHEST = "highest_harmonic"
DECK_LEVEL = "deck"
"""The mesh level of a deck: it has its own mesh."""


class Case(Part):
    """One tyre, its mesh and analysis, what may vary and what was measured."""

    format: Annotated[int, Field(ge=1, le=1)]  # version of the case file's format
    name: Text  # name in words
    size: Text  # size code
    pressure_kPa: Pressure  # inflation pressure
    # instead of section, mesh, materials, solids, layers and templates: your own deck
    deck: DeckSource | None = None
    section: SectionSource = SectionSource()  # source of the section
    # element type and meshes
    mesh: Mesh = Mesh(
        element="CGAX8", level=DECK_LEVEL, levels={DECK_LEVEL: Level(elements={}, rows=[])}
    )
    # rubbers and cords by name
    materials: dict[Name, Annotated[Rubber | Cord, Field(discriminator="kind")]] = Field(
        default_factory=dict
    )
    solids: list[Solid] = Field(default_factory=list)  # rubber by place in the section
    rebar_layers: dict[Name, RebarLayer] = Field(default_factory=dict)  # layers of cords by name
    rim: Rim  # the rigid rim and its support
    cavity: Cavity = Cavity()  # gas in the tyre
    # speed of rotation, off the road; frequencies are for a sensor that does not rotate
    spin_rad_per_s: Annotated[NotNegative, Field(le=1e4)] = 0.0
    point_mass: PointMass = PointMass()  # lumped mass on the tread
    road_spring: RoadSpring = RoadSpring()  # springs to the ground at angle 0
    splice: Splice = Splice()  # sector of other stiffness
    analysis: Analysis  # steps of the computation
    road: Road = Road()  # road, and the mesh round the tyre for it
    # sizes of effects by their id, each in its unit; 0: absent
    effects: Annotated[dict[str, Number], AfterValidator(_every_effect)] = Field(
        default_factory=lambda: dict.fromkeys(IDS, 0.0)
    )
    variables: dict[Name, Variable] = Field(default_factory=dict)  # what a fit may vary, by name
    targets: Targets = Targets()  # measured values
    # uncalibrated numbers by name
    uncertainties: dict[Name, Uncertainty] = Field(default_factory=dict)
    solver: SolverChoice  # solver and its limits
    templates: Text | None = None  # folder of your own deck templates

    @classmethod
    def problems(cls, values: CaseData) -> Iterator[Disagreement]:
        given = {key for key in (*OF_A_SECTION, *IN_A_DECK) if cls._is_given(key, values.get(key))}
        if values.get("deck") is None:
            for key in OF_A_SECTION:
                if key not in given:
                    more = ", at least 1 entries" if key in ("materials", "solids") else ""
                    yield key, f"must be given{more}"
        else:
            yield from ((key, "must be absent with deck") for key in IN_A_DECK if key in given)
            if part_values(values.get("rim")).get("holds", WHOLE_BEAD) != WHOLE_BEAD:
                yield "rim", "must be absent with deck, which names the nodes that it holds"
        if part_values(values.get("deck")).get("decks"):
            yield from cls._beside_decks(values)

    @classmethod
    def _beside_decks(cls, values: CaseData) -> Iterator[Disagreement]:
        """Disagreements with decks in three dimensions: keys that belong in the decks, not in the
        case."""
        for key in IN_DECKS:
            if cls._is_given(key, values.get(key)):
                yield key, "must be absent with deck.decks, which contain it"
        rim = part_values(values.get("rim"))
        spindle = part_values(rim.get("spindle"))
        if rim.get("free") is True or any(number(spindle, key) for key in spindle):
            yield "rim", "must be held: the decks of deck.decks contain the parts that move"
        usual, given = Analysis().__dict__, part_values(values.get("analysis"))
        if any(given.get(key, usual[key]) != usual[key] for key in usual.keys() - {HIGHEST}):
            yield "analysis", f"must say {HIGHEST} alone: the decks of deck.decks contain all else"

    @classmethod
    def _is_given(cls, key: str, value: Any) -> bool:
        """Whether a key has a value of its own."""
        return bool(value) and value != cls.model_fields[key].default

    def plain(self) -> dict[str, Any]:
        """The case as plain data, defaults and all."""
        return self.model_dump(exclude_none=True)

    @property
    def loads_N(self) -> list[float]:
        """Loads at which the tyre is pressed, rising: the road's and those with a target."""
        return sorted({*self.road.loads_N, *self.targets.loads_N})
