"""Static stiffnesses of the pressed tyre over load and pressure, and the patch and radii there.

They are those of the rim, from the tangent at each load, while the patch is held: what touches
neither slides nor lifts. Friction-limited tests give less, and the same as the force goes to 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import radians
from typing import Annotated

import numpy as np
from pydantic import Field

from ..errors import InputError
from ..files import Json
from ..simulate.deck.tyre_design import TyreDesign
from ..simulate.evaluate.evaluator import Evaluator, PressQuestion
from ..simulate.evaluate.pressed import Footprint, Pressed
from ..tyre.case import LoadedCase
from ..tyre.section.mesh import SectionMesh
from ..tyre.state import pressure_name
from .footprint import footprint_row, progress
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
    silent,
)

Array = np.ndarray
# places in a rim's stiffness: shifts along down, axle and rolling direction, and turns about them,
# right-handed as the deck's axes 1, 2, 3
VERTICAL, LATERAL, LONGITUDINAL, TORSION, SPIN = 0, 1, 2, 3, 4


class StiffnessRow(ResultPart):
    """A design at a pressure and a load, SI. All but the vertical stiffness are at this load: the
    axle's height is free."""

    design: Annotated[str, Column("design", "")]  # name of the design: initial, fitted or set
    pressure_kPa: Annotated[float, Column("kPa", ".0f")]
    load_N: Annotated[PositiveNumber, Column("load N", ".0f")]
    # vertical stiffness, nothing slides
    vertical_N_per_m: Annotated[float, Column("vertical N/mm", ".1f", 1e-3)]
    # stiffness along the axle
    lateral_N_per_m: Annotated[float, Column("lateral N/mm", ".1f", 1e-3)]
    # stiffness along the rolling direction
    longitudinal_N_per_m: Annotated[float, Column("longitudinal N/mm", ".1f", 1e-3)]
    # stiffness about the vertical
    torsional_Nm_per_rad: Annotated[float, Column("torsional Nm/°", ".1f", radians(1))]
    # vertical stiffness as by footprint: the patch slides by the law of friction
    vertical_sliding_N_per_m: float
    loaded_radius_m: float  # height of the wheel's centre
    rolling_radius_m: float  # distance over angle as the free wheel begins to roll
    deflection_m: float  # fall of the wheel's centre
    length_m: float  # largest extent of the patch along the rolling direction
    width_m: float  # largest extent of the patch across the rolling direction
    # (6, 6) N, N m per m, rad along and about down, axle, rolling direction at the wheel's
    # centre
    rim_stiffness: list[list[float]]


PATCH_COLUMNS = {
    "loaded_radius_m": Column("loaded radius mm", ".1f", 1e3),
    "rolling_radius_m": Column("rolling radius mm", ".1f", 1e3),
    "deflection_m": Column("deflection mm", ".2f", 1e3),
    "length_m": Column("length mm", ".1f", 1e3),
    "width_m": Column("width mm", ".1f", 1e3),
}


class StiffnessFindings(ResultPart):
    """Findings about a design."""

    design: str  # name of the design: initial, fitted or set
    words: list[str]  # findings in words


class StiffnessResult(Result):
    """stiffness.json"""

    study, stem, heading = "stiffness", "stiffness", "Static stiffnesses"
    figures = "tyrecal.report.footprint:stiffness_figures"
    follows_fit = True
    is_seldom = True

    designs: dict[str, dict[str, float]] = Field(default={})  # values of the variables by design
    rows: list[StiffnessRow]  # designs at pressures and loads
    failed: list[Failed]  # states that were not reached
    findings: list[StiffnessFindings]  # findings on each design

    @classmethod
    def run(
        cls,
        given: StudyInput,
        *,
        loads_N: Sequence[float] | None = None,
        at_kPa: Sequence[float] | None = None,
    ) -> StiffnessResult:
        """Every design at rising loads, N, and pressures, kPa; None: those of the case."""
        loads, kPa = loads_N or given.case.case.loads_N, at_kPa or [given.case.case.pressure_kPa]
        result = run(given.case, given.evaluator, given.designs, loads, kPa, given.jobs)
        return given.stamped(result, load_N=loads, pressure_kPa=kPa)

    def quantities(self) -> dict[str, float]:
        kinds = [key for key in StiffnessRow.columns() if "_per_" in key]
        return {
            f"{kind} {row.design} {row.pressure_kPa:g} kPa {row.load_N:g} N": getattr(row, kind)
            for row in self.rows
            for kind in kinds
        }

    def csv(self) -> str:
        keys = [key for key in StiffnessRow.model_fields if key != "rim_stiffness"]
        return csv_text(keys, (row.model_dump(include={*keys}) for row in self.rows))

    def tables(self) -> list[Table]:
        columns = StiffnessRow.columns()
        stiffness = Table(
            list(columns.values()),
            [row.cells() for row in self.rows],
            caption="tangents with the patch held; all but vertical at constant load",
        )
        named = {key: columns[key] for key in ("design", "pressure_kPa", "load_N")} | PATCH_COLUMNS
        rows = [[c.cell(getattr(row, key)) for key, c in named.items()] for row in self.rows]
        return [stiffness, Table(list(named.values()), rows)]


def run(
    case: LoadedCase,
    evaluator: Evaluator,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    at_kPa: Sequence[float],
    jobs: int = 1,
    notify: Notify = silent,
) -> StiffnessResult:
    """Every design (name to values of the variables) at pressures, kPa, and rising loads, N.

    Raises InputError for a road without friction, and what ``Evaluator.press`` raises for wrong
    input; there are no rows where no design bore the first load.
    """
    evaluator.needs_road(rim_stiffness=True)
    if not case.case.road.friction:
        raise InputError(
            "road.friction is 0, so nothing holds the patch along the road: set it, as in 0.5"
        )
    states = [(name, kPa) for name in designs for kPa in at_kPa]
    values = [{**designs[name], pressure_name(case): kPa} for name, kPa in states]
    questions = [PressQuestion(each, loads_N, rim_stiffness=True) for each in values]
    rows: list[StiffnessRow] = []
    failed: list[Failed] = []
    answers = evaluator.press_all(questions, jobs)
    for (name, kPa), each, pressed in zip(states, values, answers, strict=True):
        reached, failure = progress(pressed)
        if failure:
            place = Failed(
                design=name,
                load_N=loads_N[reached],
                pressure_kPa=kPa,
                cause=failure.cause,
                words=failure.words,
            )
            failed.append(place)
            notify(place.place, failure)
        notify(f"{name}, {kPa:g} kPa: {reached} loads", None)
        if isinstance(pressed, Pressed):
            mesh = TyreDesign(case, each).tyre.mesh
            rows += [_row(name, kPa, pressed, footprint, mesh) for footprint in pressed.footprints]
    return StiffnessResult(
        format=1,
        designs={name: dict(own) for name, own in designs.items()},
        rows=rows,
        failed=failed,
        findings=[own for name in designs if (own := _findings(name, rows))],
    )


def at_constant_load(C: Array) -> Array:
    """A rim's stiffness (6, 6) while the load is constant and the axle's height follows."""
    return C - np.outer(C[:, VERTICAL], C[VERTICAL]) / C[VERTICAL, VERTICAL]


def _row(
    design: str, kPa: float, pressed: Pressed, footprint: Footprint, mesh: SectionMesh
) -> StiffnessRow:
    assert footprint.rim_reactions is not None
    C = footprint.rim_reactions
    held = at_constant_load(C)
    patch: Json = footprint_row(pressed, footprint, mesh)
    return StiffnessRow(
        design=design,
        pressure_kPa=kPa,
        load_N=footprint.load_N,
        vertical_N_per_m=float(C[VERTICAL, VERTICAL]),
        lateral_N_per_m=float(held[LATERAL, LATERAL]),
        longitudinal_N_per_m=float(held[LONGITUDINAL, LONGITUDINAL]),
        torsional_Nm_per_rad=float(held[TORSION, TORSION]),
        vertical_sliding_N_per_m=patch["vertical_stiffness_N_per_m"],
        loaded_radius_m=pressed.free_radius_m - footprint.deflection_m,
        # no force along the road: held[LONGITUDINAL] . (dx, dspin) = 0 as the wheel begins to roll
        rolling_radius_m=abs(float(held[LONGITUDINAL, SPIN] / held[LONGITUDINAL, LONGITUDINAL])),
        deflection_m=footprint.deflection_m,
        length_m=patch["length_m"],
        width_m=patch["width_m"],
        rim_stiffness=C.tolist(),
    )


def _findings(design: str, rows: Sequence[StiffnessRow]) -> StiffnessFindings | None:
    """Ratios of the stiffnesses over the rows of a design; None without any."""
    own = [row for row in rows if row.design == design]
    if not own:
        return None
    span = lambda ratios: " to ".join(dict.fromkeys(f"{f(ratios):.2f}" for f in (min, max)))
    lateral = span([row.lateral_N_per_m / row.vertical_N_per_m for row in own])
    longitudinal = span([row.longitudinal_N_per_m / row.vertical_N_per_m for row in own])
    words = f"lateral is {lateral} and longitudinal {longitudinal} times the vertical stiffness"
    return StiffnessFindings(design=design, words=[words])
