"""How far the section may be off, smoothly: meridian, gauges, compounds' stiffness and density.

Each is a Gaussian random field over s, the arc length of the carcass from the crown (0) to where
the rim holds it (1), alike on both sides, its covariance exp(-(s - s')^2 / (2 l^2)) in units of its
variance; meridian and gauges are 0 at the rim. Karhunen and Loeve's components of it, with 99 % of
the variance, are sources of error (Rasmussen and Williams, Gaussian Processes, sec. 4.3). The case
states what its section is known from, and so how large they are:

    section: {stations: tyre.csv, known_from: drawing}
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...tyre.case import LoadedCase
from ...tyre.case.schema import Rubber
from ...tyre.effects.parts import carcass_line, rim_edge, stations
from .regions import split_by_region

Array = np.ndarray
SECTION = "section "  # with which their names begin
FIELD_KINDS = ("meridian", "gauge", "stiffness", "density")
SECTION_SIZES = {  # standard deviations, by judgement: m along the normal, the others relative
    "measured": (0.3e-3, 0.02, 0.03, 0.01),  # a cut tyre and a scale
    "drawing": (0.8e-3, 0.04, 0.05, 0.01),  # moulds are true, plies and rubber flow
    "size_code": (3e-3, 0.10, 0.10, 0.02),  # tyres of one size from several makers
}
CORRELATION_LENGTH = 0.25  # l, of the half meridian
KEPT_VARIANCE = 0.99  # of the variance
FIELD_GRID = 200  # points for the components
COMPOUNDS_ALIKE = 0.5  # correlation of two compounds at one place


@dataclass(frozen=True)
class SectionField:
    """One component at one standard deviation."""

    kind: str
    values: Array  # (stations,) m outwards, or relative; of compounds (parts,)


def fields(case: LoadedCase) -> dict[str, SectionField]:
    """Components by name; none where the case does not say what its section is known from."""
    known = case.case.section.known_from
    if known is None:
        return {}
    size = dict(zip(FIELD_KINDS, SECTION_SIZES[known], strict=True))
    s = arc_length(case)
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
    by_kind = {"meridian": along, "gauge": along, "stiffness": compounds, "density": compounds}
    return {
        f"{SECTION}{kind} {i}": SectionField(kind, size[kind] * values)
        for kind, shapes in by_kind.items()
        for i, values in enumerate(shapes, 1)
    }


def rubber_parts(case: LoadedCase) -> dict[str, str]:
    """Names of the parts of rubber by material, as `split_by_region` has them."""
    split, parts = split_by_region(case)
    return {k: name for k, name in parts.items() if isinstance(split.case.materials[k], Rubber)}


def words(case: LoadedCase) -> str:
    """What is assumed, for people."""
    known = case.case.section.known_from
    if known is None:
        return ""
    meridian, gauge, stiffness, density = SECTION_SIZES[known]
    return (
        f"section known from {known.replace('_', ' ')}: meridian {1e3 * meridian:g} mm, gauges"
        f" {gauge:.0%}, compounds' stiffness {stiffness:.0%} and density {density:.0%}, smooth"
    )


def arc_length(case: LoadedCase) -> Array:
    """s (stations,) of the carcass, 1 where the rim begins. Raises ValueError without a carcass."""
    line = case.section.points[case.section.names.index(carcass_line(case))]
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    return np.asarray(length / length[rim_edge(case.section)])


def components(s: Array) -> Array:
    """Karhunen and Loeve's, at one standard deviation (k, stations), of a field that is 0 from
    s = 1 on."""
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
    """The case with so much of a component of its meridian or its gauges."""
    section = case.section
    carcass = section.points[section.names.index(carcass_line(case))]
    if field.kind == "gauge":
        points = carcass + (section.points - carcass) * (1 + amount * field.values)[:, None]
    else:
        r, z = np.gradient(carcass, axis=0).T
        normal = np.stack([-z, r], 1) / np.hypot(r, z)[:, None]
        outwards = np.sign(((section.points[-1] - section.points[0]) * normal).sum(1))
        points = section.points + amount * (field.values * outwards)[:, None] * normal
    return replace(case, drawn=replace(section, points=points))


def _kernel(a: Array, b: Array) -> Array:
    """Correlation (a, b) of a field that is alike on both sides of the crown."""
    k = lambda x: np.exp(-(x**2) / (2 * CORRELATION_LENGTH**2))
    both = k(a[:, None] - b) + k(a[:, None] + b)
    return np.asarray(both / np.sqrt(np.outer(1 + k(2 * a), 1 + k(2 * b))))
