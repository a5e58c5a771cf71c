"""Errors of the section, smooth along it: meridian, gauges, compounds' stiffness and density.

Each is a Gaussian random field over s, the arc length of the carcass from the crown (0) to where
the rim holds it (1), the same on both sides. Its correlation is exp(-(s - s')^2 / (2 l^2));
meridian and gauges are 0 at the rim. Its Karhunen-Loeve components with 99 % of the variance are
sources of error (Rasmussen and Williams, Gaussian Processes, sec. 4.3). Two are single numbers:

* the height of a bead filler with its own rubber: with a higher one, modes across the wheel rise
  less with the pressure;
* the place from which on the rim holds the bead, because the bead yields between the rim and its
  wires. Whether a car's rim holds the whole bead or its surface (`rim.holds`) changes [0,0] lateral
  by 6 % and torsional by 2 %, as if it held 7 mm further up.

The case states what its section is known from. That gives their standard deviations:

    section: {stations: tyre.csv, known_from: drawing}

The default is a drawing; `tyrecal init` states what it made from a size code. Only data that were
computed with this very section have an exact one.

`SectionDesign` is the design of a case with such errors: they are numbers in addition to its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError
from ...simulate.deck.tyre_design import DECK_STEP, TyreDesign
from ...tyre.case import LoadedCase
from ...tyre.case.parts import SectionOrigin
from ...tyre.case.schema import Rubber
from ...tyre.effects.edit import with_part
from ...tyre.effects.parts import belt_edge, carcass_line, rim_edge, stations, turned_up
from ...tyre.section.curve import length_along
from .regions import split_by_region

Array = np.ndarray
SECTION = "section "  # start of the names of these sources of error
OF_COMPOUNDS = ("stiffness", "density")
OF_ORIGIN = ("meridian", "filler", "gauge", *OF_COMPOUNDS)
FIELD_KINDS = ("meridian", "filler", "hold", "gauge", *OF_COMPOUNDS)
ALONG_CARCASS = ("filler", "hold")
# standard deviations in the order of OF_ORIGIN, by judgement: meridian, m along its normal; tip of
# the filler, m along the carcass (fillers of one size reach 30 to 60 mm above the rim); gauge,
# stiffness, density, relative
SECTION_SIZES = {
    "exact": (0.0, 0.0, 0.0, 0.0, 0.0),  # that of the model which made the data
    "measured": (0.3e-3, 1e-3, 0.02, 0.03, 0.01),  # a cut tyre and a scale
    "drawing": (0.8e-3, 2e-3, 0.04, 0.05, 0.01),  # moulds are true, plies and rubber flow
    "size_code": (3e-3, 9e-3, 0.10, 0.10, 0.02),  # tyres of one size from several makers
}
HOLD = 0.3  # standard deviation of the place where the rim begins to hold, over bead thickness
CAR_HEIGHT = 0.15  # m of carcass above the rim; errors by a size code grow with larger heights
UNSAID: SectionOrigin = "drawing"
CORRELATION_LENGTH = 0.25  # l, over s
KEPT_VARIANCE = 0.99  # share of the variance that the components have
FIELD_GRID = 200  # points on s at which the components are computed
COMPOUNDS_ALIKE = 0.5  # correlation of two compounds at one place


@dataclass(frozen=True)
class SectionField:
    """One component at one standard deviation."""

    kind: str  # one of FIELD_KINDS
    # (stations,) m outwards, towards the crown, or relative; of compounds (parts,) relative
    values: Array

    @property
    def moves(self) -> bool:
        """Whether it moves points of the section."""
        return self.kind not in OF_COMPOUNDS


def known_from(case: LoadedCase) -> SectionOrigin:
    """Origin of the section's data; "exact" for a user's decks, which have no stations."""
    return case.kind.section_origin(case.case) or UNSAID


def fields(case: LoadedCase) -> dict[str, SectionField]:
    """Components by name; none of an exact section, nor of one without a carcass to count s by.

    Raises InputError where such a section states what it is known from.
    """
    known = known_from(case)
    if known == "exact":
        return {}
    try:
        s = arc_length(case)
    except InputError:
        if case.case.section.known_from is None:
            return {}
        raise InputError(
            f"section.known_from must be exact, got {known}: no layer of cords runs from bead to"
            " bead, along which its errors would be smooth"
        ) from None
    size = dict(zip(OF_ORIGIN, sizes(case), strict=True)) | {"hold": HOLD * bead_thickness(case)}
    along = components(s)
    split, _ = split_by_region(case)
    region = {solid.material: (solid.regions or [""])[0] for solid in split.case.solids}
    rubbers = rubber_parts(case)
    ends = [stations(case.section, region[name]) for name in rubbers]
    places = np.array([s[first : last + 1].mean() for first, last in ends])
    alike = _kernel(places, places) * (
        COMPOUNDS_ALIKE + (1 - COMPOUNDS_ALIKE) * np.eye(len(rubbers))
    )
    compounds = np.linalg.cholesky(alike).T
    by_kind = {
        "meridian": along,
        "filler": higher_filler(case),
        "hold": higher_hold(case),
        "gauge": along,
        "stiffness": compounds,
        "density": compounds,
    }
    return {
        f"{SECTION}{kind} {i}": SectionField(kind, size[kind] * values)
        for kind, shapes in by_kind.items()
        for i, values in enumerate(shapes, 1)
    }


def sizes(case: LoadedCase) -> tuple[float, ...]:
    """Standard deviations in the order of OF_ORIGIN, for a section of this height. Raises
    InputError without a carcass."""
    known = known_from(case)
    meridian, filler, *others = SECTION_SIZES[known]
    carcass = case.section.points[case.section.names.index(carcass_line(case))]
    height = float(np.ptp(carcass[: rim_edge(case.section) + 1, 0]))
    taller = max(1.0, height / CAR_HEIGHT) if known == "size_code" else 1.0
    return (taller * meridian, taller * filler, *others)


def rubber_parts(case: LoadedCase) -> dict[str, str]:
    """Names of the parts of rubber by material, as `split_by_region` has them."""
    split, parts = split_by_region(case)
    return {k: name for k, name in parts.items() if isinstance(split.case.materials[k], Rubber)}


def words(case: LoadedCase) -> str:
    """Assumptions about the section, for people."""
    known = known_from(case)
    meridian, filler, gauge, stiffness, density = sizes(case)
    tip = f" bead filler's tip {1e3 * filler:.2g} mm," if len(higher_filler(case)) else ""
    hold = 1e3 * HOLD * bead_thickness(case)
    unsaid = "" if case.case.section.known_from else ", not stated in the case"
    return (
        f"section known from {known.replace('_', ' ')}{unsaid}: meridian {1e3 * meridian:.2g} mm,"
        f"{tip} rim's hold {hold:.2g} mm, gauges {100 * gauge:.0f} %, compounds' stiffness"
        f" {100 * stiffness:.0f} % and density {100 * density:.0f} %, smooth"
    )


def filler_tip(case: LoadedCase) -> int | None:
    """Station at which the bead filler ends, a rubber of its own between the carcass and its
    turn-up; None where there is none. Raises InputError without a carcass."""
    line = (turned_up(case) or ("",))[0]
    for solid in case.case.solids:
        if solid.between == [carcass_line(case), line] and solid.regions:
            return min(stations(case.section, name)[0] for name in solid.regions)
    return None


def higher_filler(case: LoadedCase) -> Array:
    """Motion of the stations along the carcass if the filler's tip moves by 1, (1, stations);
    (0, stations) without a filler. It falls linearly to 0 at the rim, and at the end of the turn-up
    (of the belt, if the turn-up ends at the tip)."""
    s, tip = arc_length(case), filler_tip(case)
    if tip is None:
        return np.empty((0, len(s)))
    turn_up = turned_up(case)
    assert turn_up
    end = min(stations(case.section, name)[0] for name in turn_up[1])
    above = end if end < tip else belt_edge(case)
    return np.interp(s, s[[above, tip, rim_edge(case.section)]], [0.0, 1.0, 0.0])[None]


def bead_thickness(case: LoadedCase) -> float:
    """Thickness, m, of the bead where the rim begins to hold it."""
    at_rim = case.section.points[[0, -1], rim_edge(case.section)]
    return float(np.hypot(*(at_rim[1] - at_rim[0])))


def higher_hold(case: LoadedCase) -> Array:
    """Motion (1, stations) of the stations along the carcass if the place where the rim begins to
    hold moves by 1. All stations that it holds move by 1. Above, the motion falls linearly to 0 at
    the filler's tip, or at the widest point."""
    s = arc_length(case)
    carcass = case.section.points[case.section.names.index(carcass_line(case))]
    tip = filler_tip(case)
    above = int(np.argmax(carcass[:, 1])) if tip is None else tip
    return np.interp(s, [s[above], 1.0], [0.0, 1.0])[None]


def arc_length(case: LoadedCase) -> Array:
    """s (stations,) of the carcass, 1 where the rim begins. Raises InputError without a carcass."""
    line = case.section.points[case.section.names.index(carcass_line(case))]
    length = length_along(line)
    return length / length[rim_edge(case.section)]


def components(s: Array) -> Array:
    """Karhunen-Loeve components (k, stations), each at one standard deviation, of a field that is 0
    from s = 1 on."""
    t = (np.arange(FIELD_GRID) + 0.5) / FIELD_GRID
    end = np.ones(1)
    free = lambda a, b: _kernel(a, b) - _kernel(a, end) @ _kernel(end, b)
    variance, shapes = np.linalg.eigh(free(t, t) / FIELD_GRID)
    variance, shapes = variance[::-1], shapes[:, ::-1]
    count = 1 + int(np.searchsorted(np.cumsum(variance) / variance.sum(), KEPT_VARIANCE))
    between = free(s, t) @ shapes[:, :count] / np.sqrt(FIELD_GRID * variance[:count])
    between *= np.sign(between[0])
    return np.where(s < 1, between.T, 0.0)


def moved(case: LoadedCase, field: SectionField, amount: float) -> LoadedCase:
    """The case with ``amount`` times a component of its meridian, filler, hold or gauges."""
    section = case.section
    carcass = section.points[section.names.index(carcass_line(case))]
    if field.kind == "gauge":
        points = carcass + (section.points - carcass) * (1 + amount * field.values)[:, None]
    elif field.kind in ALONG_CARCASS:
        # stations slide along each surface, and parallel to the carcass on the lines inside
        arc = length_along(carcass)
        along = np.stack([np.gradient(carcass, arc, axis=0)] * len(section.names))
        along[[0, -1]] = np.gradient(section.points[[0, -1]], arc, axis=1)
        points = section.points - amount * field.values[:, None] * along
    else:
        r, z = np.gradient(carcass, axis=0).T
        normal = np.stack([-z, r], 1) / np.hypot(r, z)[:, None]
        outwards = np.sign(((section.points[-1] - section.points[0]) * normal).sum(1))
        points = section.points + amount * (field.values * outwards)[:, None] * normal
    return replace(case, drawn=replace(section, points=points))


def with_fields(case: LoadedCase, amounts: Mapping[str, float]) -> LoadedCase:
    """The case with the given amounts, in standard deviations, of all components by name."""
    known = fields(case)
    if not known:
        return case
    split, _ = split_by_region(case)
    names = list(rubber_parts(case))
    off = {kind: np.zeros(len(names)) for kind in OF_COMPOUNDS}
    made = split
    for name, field in known.items():
        if field.kind in off:
            off[field.kind] += amounts[name] * field.values
        else:
            made = moved(made, field, amounts[name])
    materials = dict(split.case.materials)
    for name, stiffer, denser in zip(names, *np.exp([*off.values()]).tolist(), strict=True):
        m = materials[name]
        assert isinstance(m, Rubber)
        materials[name] = with_part(
            m,
            C10_Pa=stiffer * m.C10_Pa,
            C01_Pa=stiffer * m.C01_Pa,
            D1_per_Pa=m.D1_per_Pa / stiffer,
            density_kg_per_m3=denser * m.density_kg_per_m3,
        )
    return replace(made, case=made.case.model_copy(update={"materials": materials}))


def _kernel(a: Array, b: Array) -> Array:
    """Correlation between places ``a`` and ``b`` of a field that is the same on both sides."""
    k = lambda x: np.exp(-(x**2) / (2 * CORRELATION_LENGTH**2))
    both = k(a[:, None] - b) + k(a[:, None] + b)
    return np.asarray(both / np.sqrt(np.outer(1 + k(2 * a), 1 + k(2 * b))))


FIELD_STEP = 0.01  # standard deviations to either side, to see how nodes move with a field


class SectionDesign(TyreDesign):
    """A case at values of its numbers and of fields of its meridian and its gauges, by name, in
    standard deviations. Sensitivities by a field are those by the nodes that it moves."""

    def __init__(
        self,
        case: LoadedCase,
        fields: Mapping[str, SectionField],
        values: Mapping[str, float] | None = None,
        plain: LoadedCase | None = None,
    ):
        given = dict(values or {})
        self.amounts = {k: v for k, v in given.items() if k in fields and v}
        for name, amount in self.amounts.items():
            case = moved(case, fields[name], amount)
        super().__init__(case, {k: v for k, v in given.items() if k not in fields}, plain)
        self.fields, self.values = fields, given

    @property
    def is_nominal(self) -> bool:
        """Whether nothing is set, and no field is off."""
        return not self.amounts and super().is_nominal

    def at(self, values: Mapping[str, float]) -> SectionDesign:
        """The case with these values. Raises ValueError."""
        return SectionDesign(self.case, self.fields, values, self.plain)

    def neighbour(self, name: str, side: int) -> tuple[TyreDesign, float]:
        """Neighbour of the design, as of a number of the case, and its step: of a field in standard
        deviations."""
        if name not in self.fields:
            return super().neighbour(name, side)
        amount = side * FIELD_STEP
        return TyreDesign(moved(self.case, self.fields[name], amount), {}, self.plain), amount

    def steps(self, name: str, value: float, step: float) -> list[float]:
        """Values for differences; a field's step is `FIELD_STEP` where that of others is
        `DECK_STEP`."""
        if name not in self.fields:
            return super().steps(name, value, step)
        return [value + side * step * FIELD_STEP / DECK_STEP for side in (1, -1)]
