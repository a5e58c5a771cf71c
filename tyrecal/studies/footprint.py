"""Footprints: contact area, length, width, pressure, deflection and stiffness at rising loads.

`Patch` has the tread of the pressed tyre as a grid of lines round and across it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from contourpy import contour_generator
from pydantic import Field

from ..simulate.deck.tyre_design import TyreDesign
from ..simulate.evaluate.evaluator import Evaluator, PressQuestion
from ..simulate.evaluate.failure import EvaluationFailed
from ..simulate.evaluate.pressed import Footprint, Pressed
from ..tyre.case import LoadedCase
from ..tyre.section.mesh import SectionMesh
from .result import (
    Column,
    Failed,
    Notify,
    PositiveNumber,
    Result,
    ResultPart,
    StudyInput,
    Table,
    csv_text,
    not_reached,
    notify_loads,
    silent,
)

Array = np.ndarray
FINE_STEPS = 8  # of an element of three nodes, between which its depth is a parabola


@dataclass(frozen=True)
class Patch:
    """The outer surface seen from the road, (ring, node across): rings in the direction of rolling
    with the patch's middle amid them, nodes from -z to +z."""

    along: Array  # m in the road's plane, towards larger angles of the rings
    across: Array  # m in the road's plane, towards +z
    pressure: Array  # Pa, 0 where it does not touch
    touches: Array  # bool
    # m, of nodes below the road, by a solver that places the patch's edge between nodes, else None
    depth: Array | None = None
    # whether every second node across is the middle of an element, as every second ring is
    midside: bool = False

    @property
    def length_m(self) -> float:
        """Extent along; it ends half-way between the last node that touches and the next."""
        return _extent(self.along, self.touches)

    @property
    def width_m(self) -> float:
        """Extent across, likewise."""
        return _extent(self.across.T, self.touches.T)

    def edges(self) -> list[Array]:
        """The patch's edge as closed lines (points, 2), across and along in m: where the depth is
        0, or half-way between nodes that touch and the next."""
        touching = [self.across, self.along, np.where(self.touches, 1.0, -1.0)]
        if self.depth is None:
            return _zero_lines(touching)
        fields = [_refined(field) for field in (self.across, self.along, self.depth)]
        if self.midside:
            fields = [_refined(field.T).T for field in fields]
        return _zero_lines(fields) or _zero_lines(touching)


def patch_of(pressed: Pressed, footprint: Footprint, mesh: SectionMesh) -> Patch:
    """The patch at one load on the section's mesh; the angle 0 is below the axle."""
    order = np.argsort((pressed.angles + np.pi) % (2 * np.pi))
    row = {int(node): i for i, node in enumerate(pressed.nodes)}
    line = [row[node] for node in mesh.outer_nodes]
    R, Z = pressed.points[line].T
    angle = pressed.angles[:, None]
    u_r, u_theta, u_z = np.moveaxis(footprint.displacement[:, line], -1, 0)
    along = np.sin(angle) * (R + u_r) + np.cos(angle) * u_theta
    down = np.cos(angle) * (R + u_r) - np.sin(angle) * u_theta
    pressure = np.zeros((len(pressed.angles), len(pressed.nodes)))
    touches = np.zeros(pressure.shape, bool)
    rows = [row[int(node)] for node in footprint.node]
    pressure[footprint.ring, rows], touches[footprint.ring, rows] = footprint.pressure_Pa, True
    depth = (down - (pressed.free_radius_m - footprint.deflection_m))[order]
    return Patch(
        along[order],
        (Z + u_z)[order],
        pressure[:, line][order],
        touches[:, line][order],
        None if footprint.contact_length_m is None else depth,
        mesh.quadratic,
    )


def _extent(place: Array, touches: Array) -> float:
    """Largest less least of the half-way places beside touching rows of a grid."""
    between = (place[:-1] + place[1:]) / 2
    below, above = np.concatenate([place[:1], between]), np.concatenate([between, place[-1:]])
    return float(above[touches].max() - below[touches].min())


def _refined(field: Array) -> Array:
    """A field (ring, ...) on `FINE_STEPS` steps of each three rings, as a parabola through them."""
    xi = np.linspace(-1.0, 1.0, FINE_STEPS, endpoint=False)[:, None]
    a, b, c = (each[:, None] for each in (field[:-2:2], field[1:-1:2], field[2::2]))
    within = b + xi * (c - a) / 2 + xi**2 * (a - 2 * b + c) / 2
    return np.concatenate([within.reshape(-1, field.shape[1]), field[-1:]])


def _zero_lines(fields: Sequence[Array]) -> list[Array]:
    """Lines (points, 2), in the first two of three fields, where the last is 0."""
    contours: Any = contour_generator(*fields)
    return [np.asarray(line) for line in contours.lines(0.0)]


USUAL_SHARE = (0.8, 1.6)  # mean contact pressure over the inflation, of a passenger car; assumed
PressOutcome = Pressed | EvaluationFailed


def press(
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    jobs: int = 1,
    notify: Notify = silent,
) -> dict[str, PressOutcome]:
    """Every design (name to values of the variables) at rising loads, or why not even at the
    first one; those after the first begin from its state on the road. Raises DeckRefused and what
    else ``Evaluator.press`` raises for wrong input."""
    by_design: dict[str, PressOutcome] = {}
    base = next(iter(designs.values())) if len(designs) > 1 else None
    questions = [PressQuestion(values, loads_N, base=base) for values in designs.values()]
    outcomes = evaluator.press_all(questions, jobs)
    for design, outcome in zip(designs, outcomes, strict=True):
        by_design[design] = outcome
        notify_loads(notify, design, loads_N, *progress(outcome))
    return by_design


def progress(outcome: PressOutcome) -> tuple[int, EvaluationFailed | None]:
    """How many loads were reached, and why no more."""
    if isinstance(outcome, Pressed):
        return len(outcome.footprints), outcome.failed
    return 0, outcome


class FootprintRow(ResultPart):
    """The tyre at one load, SI."""

    design: Annotated[str, Column("design", "")]  # name of the design: initial, fitted or set
    load_N: Annotated[PositiveNumber, Column("load N", ".0f")]
    # fall of the wheel's centre
    deflection_m: Annotated[float, Column("deflection mm", ".2f", 1e3)]
    area_m2: Annotated[PositiveNumber, Column("area cm²", ".1f", 1e4)]  # area of the patch
    # largest extent of the patch along the rolling direction
    length_m: Annotated[float, Column("length mm", ".1f", 1e3)]
    # largest extent of the patch across the rolling direction
    width_m: Annotated[float, Column("width mm", ".1f", 1e3)]
    mean_pressure_Pa: Annotated[float, Column("mean kPa", ".1f", 1e-3)]  # mean contact pressure
    # largest contact pressure
    peak_pressure_Pa: Annotated[PositiveNumber, Column("peak kPa", ".1f", 1e-3)]
    # tangent at the load
    vertical_stiffness_N_per_m: Annotated[float, Column("stiffness N/mm", ".1f", 1e-3)]


class FootprintFindings(ResultPart):
    """Findings from the rows of footprints."""

    # area of the fitted over that of the initial design: load_N, ratio
    fitted_over_initial: list[dict[str, float]] = Field(default=[])
    # mean contact pressure over inflation pressure, by design: load_N, ratio
    mean_over_inflation: dict[str, list[dict[str, float]]] = Field(default={})
    words: list[str]  # findings in words


class FootprintResult(Result):
    """footprint.json"""

    study, stem, heading = "footprint", "footprint", "Footprint"
    part = "tyrecal.report.html.states:footprint_part"
    figures = "tyrecal.report.footprint:figures"
    follows_fit = True

    pressure_kPa: dict[str, float] = Field(default={})  # inflation pressure by design
    designs: dict[str, dict[str, float]] = Field(default={})  # values of the variables by design
    rows: list[FootprintRow]  # designs at loads
    failed: list[Failed]  # loads that were not reached
    findings: FootprintFindings  # findings from the rows

    @classmethod
    def run(cls, given: StudyInput, *, loads_N: Sequence[float] | None = None) -> FootprintResult:
        """Every design at rising loads, N; None: those of the case."""
        given.evaluator.needs_road()
        loads = loads_N or given.case.case.loads_N
        result, _, _ = run(given.case, given.evaluator, given.designs, loads, given.jobs)
        return given.stamped(result, load_N=loads)

    def quantities(self) -> dict[str, float]:
        return {
            f"{kind} {row.design} {row.load_N:g} N": value
            for row in self.rows
            for kind, value in row.model_dump(exclude={"design", "load_N"}).items()
        }

    def csv(self) -> str:
        return csv_text(list(FootprintRow.model_fields), (row.model_dump() for row in self.rows))

    def tables(self) -> list[Table]:
        caption = "mean and peak: contact pressure; stiffness: tangent at the load"
        columns = list(FootprintRow.columns().values())
        return [Table(columns, [row.cells() for row in self.rows], caption=caption)]


def run(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    jobs: int = 1,
    notify: Notify = silent,
) -> tuple[FootprintResult, dict[str, Pressed], dict[str, SectionMesh]]:
    """Every design at rising loads: the result, and what was reached, with the sections' meshes.
    Raises as ``press`` does; the result has no rows where no design bore the first load."""
    outcomes = press(evaluator, designs, loads_N, jobs, notify)
    pressed = {name: each for name, each in outcomes.items() if isinstance(each, Pressed)}
    meshes = {name: TyreDesign(case, designs[name]).tyre.mesh for name in pressed}
    return footprint_result(designs, loads_N, outcomes, meshes), pressed, meshes


def footprint_result(
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    outcomes: Mapping[str, PressOutcome],
    meshes: Mapping[str, SectionMesh],
) -> FootprintResult:
    """outcomes: of ``press``; meshes: of the designs' sections."""
    pressed = {name: each for name, each in outcomes.items() if isinstance(each, Pressed)}
    rows = [
        FootprintRow(design=name, **footprint_row(each, footprint, meshes[name]))
        for name, each in pressed.items()
        for footprint in each.footprints
    ]
    pressures = {name: each.pressure_kPa for name, each in pressed.items()}
    return FootprintResult(
        format=1,
        pressure_kPa=pressures,
        designs={name: dict(values) for name, values in designs.items()},
        rows=rows,
        failed=not_reached(loads_N, {name: progress(each) for name, each in outcomes.items()}),
        findings=findings(rows, pressures),
    )


def footprint_row(pressed: Pressed, footprint: Footprint, mesh: SectionMesh) -> dict[str, float]:
    """Numbers of one load: areas in m2, lengths in m, pressures in Pa, stiffness in N/m."""
    patch = patch_of(pressed, footprint, mesh)
    # the solver's own where it places the patch's edge between nodes
    area = footprint.contact_area_m2 or float(footprint.area_m2.sum())
    return {
        "load_N": footprint.load_N,
        "deflection_m": footprint.deflection_m,
        "area_m2": area,
        "length_m": footprint.contact_length_m or patch.length_m,
        "width_m": footprint.contact_width_m or patch.width_m,
        "mean_pressure_Pa": footprint.road_N / area,
        "peak_pressure_Pa": float(footprint.pressure_Pa.max()),
        "vertical_stiffness_N_per_m": footprint.stiffness_N_per_m,
    }


def findings(rows: Sequence[FootprintRow], pressure_kPa: Mapping[str, float]) -> FootprintFindings:
    """Findings from the rows; ``pressure_kPa``: inflation by design."""
    area = {(row.design, row.load_N): row.area_m2 for row in rows}
    loads = [load for design, load in area if design == "fitted" and ("initial", load) in area]
    ratios = {load: area["fitted", load] / area["initial", load] for load in loads}
    words = [_larger(ratios)] if ratios else []
    means = {}
    for design, kPa in pressure_kPa.items():
        if kPa:
            own = [row for row in rows if row.design == design]
            means[design] = {row.load_N: row.mean_pressure_Pa / kPa / 1e3 for row in own}
            words.append(f"{design}: {_mean(means[design])}")
    return FootprintFindings(
        fitted_over_initial=_by_load(ratios),
        mean_over_inflation={design: _by_load(shares) for design, shares in means.items()},
        words=words,
    )


def _by_load(values: Mapping[float, float]) -> list[dict[str, float]]:
    return [{"load_N": load, "ratio": value} for load, value in values.items()]


def _larger(ratios: Mapping[float, float]) -> str:
    """Where the fitted tyre has the larger area."""
    listed = ", ".join(f"{100 * (x - 1):+z.1f} % at {load:g} N" for load, x in ratios.items())
    odd = [f"{load:g} N" for load, x in ratios.items() if x <= 1]
    claim = "the fitted tyre's area is larger than the initial one's at"
    if not odd:
        return f"{claim} every load: {listed}"
    if len(odd) == len(ratios):
        return f"{claim} no load: {listed}"
    return f"{claim} all loads but {', '.join(odd)}: {listed}"


def _mean(shares: Mapping[float, float]) -> str:
    """How the mean contact pressure stands to the inflation pressure."""
    low, high = USUAL_SHARE
    odd = [f"{load:g} N ({x:.2f})" for load, x in shares.items() if not low <= x <= high]
    span = " to ".join(dict.fromkeys(f"{f(shares.values()):.2f}" for f in (min, max)))
    usual = f"the usual {low:g} to {high:g}"
    return f"mean contact pressure is {span} of the inflation pressure, " + (
        f"outside {usual} at {', '.join(odd)}" if odd else f"within {usual}"
    )
