"""Results of pressing a tyre on the road, whichever solver ran: the patch at each load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict

from . import answer_fields as of
from .failure import EvaluationFailed
from .solver import SolverAnswer

Array = np.ndarray
BALANCE = 0.01  # of the load, by which the road's force may differ from it


@dataclass(frozen=True)
class Footprint:
    """The tyre at one load, with its patch of p nodes and, where they were requested, m modes. The
    fields are checked as the types state (`recorded.check`)."""

    __pydantic_config__ = ConfigDict(extra="forbid", defer_build=True)

    load_N: of.PositiveFinite
    road_N: of.Finite  # resultant of the contact pressure
    # (3,) of the rim on the tyre: down, along the axle, along the road
    rim_N: Annotated[Array, of.shaped(of.REAL, 3)]
    deflection_m: of.Finite  # of the axle towards the road since the tyre was free
    stiffness_N_per_m: of.Finite  # tangent d force / d deflection
    ring: of.WholeArray  # (p,) place among the angles
    node: of.WholeArray  # (p,) deck number
    along_m: of.RealArray  # (p,) place on the road, from below the axle backwards (Theta > 0)
    across_m: of.RealArray  # (p,) place along the axle, z
    pressure_Pa: of.RealArray  # (p,)
    area_m2: of.RealArray  # (p,) that the node stands for
    # (p, 2) along and across, of the tyre on the road
    traction_Pa: Annotated[Array, of.shaped(of.REAL, None, 2)]
    # (ring, node, 3): r, theta, z of the undeformed point, from its uninflated place, m
    displacement: of.Field3D
    # this and the next two: of a solver that places the patch's edge between nodes, else None;
    # nodes next to the patch then have a share of it, too
    contact_area_m2: of.PositiveFinite | None = None
    contact_length_m: of.PositiveFinite | None = None
    contact_width_m: of.PositiveFinite | None = None
    mode_frequency_Hz: of.HertzArray | None = None  # (m,); with friction the patch sticks in them
    mode_node: of.WholeArray | None = None  # (j,) the only nodes of the shapes
    mode_shape: of.Shapes3D | None = None  # (m, ring, j, 3) as displacement, any scale
    mode_damping_ratio: of.RealArray | None = None  # (m,) where a loss factor is known
    # (m,) the patch's forces in the road's plane in each shape, in its scale, their sizes summed
    mode_traction_N: of.RealArray | None = None
    # modes of a patch that slides freely, as the two above
    sliding_frequency_Hz: of.HertzArray | None = None
    sliding_shape: of.Shapes3D | None = None
    # (6, 6) rows: shifts (m), then turns (rad) of the rim along and about the deck's axes 1, 2,
    # 3 (down, axle, rolling direction, right-handed); columns: forces and moments, N and N m, that
    # they take, likewise; the patch is held
    rim_reactions: Annotated[Array, of.shaped(of.REAL, 6, 6)] | None = None
    # responses with the rim and the patch held, as `Solver.read` has them
    response: Mapping[str, Any] | None = None
    # the gas' first wave fore and aft, and up and down, between rigid walls
    cavity_Hz: of.HertzPair | None = None
    # by variable and name, derivatives of the numbers above by the requested variables
    slopes: Mapping[str, Mapping[str, of.Finite]] = field(default_factory=dict)
    # (variable, ring, node, 3) in the order of ``slopes``, of a solver that begins at other states
    displacement_slopes: of.Shapes3D | None = None


@dataclass(frozen=True)
class Pressed:
    """One design at rising loads."""

    pressure_kPa: float
    mass_kg: float  # of the tyre without rim
    nodes: Array  # (n,) deck numbers
    points: Array  # (n, 2) R, Z in m, not inflated
    # (k,) of the rings, rad from the patch's middle, rising from 0 to < 2 pi, -angle for each angle
    angles: Array
    free_radius_m: float  # inflated, without a load
    footprints: tuple[Footprint, ...]
    failed: EvaluationFailed | None = None  # why the load after the last footprint was not reached
    # of the first wave in the cavity before any load, where there is a gas
    cavity_Hz: float | None = None


def pressed(
    answer: SolverAnswer,
    loads_N: Sequence[float],
    kept: Path | None,
    modes: int = 0,
    rim_stiffness: bool = False,
) -> Pressed:
    """The typed form of an answer that `recorded.check` has passed to ``loads_N``, of a run whose
    folder is ``kept`` or None, with so many ``modes`` at each, and the reactions of the rim where
    ``rim_stiffness`` is wanted.

    Raises EvaluationFailed where it does not hold the loads in their order, one at least, each
    borne by the road, or not their modes.
    """
    footprints = tuple(
        Footprint(**{k: _plain(v) for k, v in each.items()}) for each in answer["footprints"]
    )
    words, reached = answer["failure"], [each.load_N for each in footprints]
    loads_agree = (
        np.allclose(reached, loads_N[: len(footprints)], rtol=1e-9) if footprints else False
    )
    if not loads_agree or bool(words) == (len(footprints) == len(loads_N)):
        raise EvaluationFailed("no_results", f"footprints at {reached} N of {list(loads_N)} N")
    for each in footprints:
        if not abs(each.road_N - each.load_N) <= BALANCE * each.load_N:
            raise EvaluationFailed(
                "no_results", f"the road bears {each.road_N:g} N of {each.load_N:g} N"
            )
        hertz = each.mode_frequency_Hz
        if modes and (hertz is None or len(hertz) < modes or not (hertz > 0).all()):
            raise EvaluationFailed("no_results", f"not {modes} modes at {each.load_N:g} N")
        if rim_stiffness and each.rim_reactions is None:
            raise EvaluationFailed("no_results", f"no reactions of the rim at {each.load_N:g} N")
    return Pressed(
        pressure_kPa=answer["pressure_Pa"] / 1e3,
        mass_kg=answer["mass_kg"],
        nodes=np.ascontiguousarray(answer["nodes"]),
        points=np.ascontiguousarray(answer["points"]),
        angles=np.ascontiguousarray(answer["angles"]),
        free_radius_m=answer["free_radius_m"],
        footprints=footprints,
        failed=EvaluationFailed(answer.get("cause", "no_equilibrium"), words, kept)
        if words
        else None,
        cavity_Hz=answer.get("cavity_Hz"),
    )


def _plain(value: Any) -> Any:
    """Arrays laid out alike, so that sums are too, recorded or not; numbers as floats."""
    if isinstance(value, Mapping):
        return value
    return np.ascontiguousarray(value) if np.ndim(value) else float(value)
