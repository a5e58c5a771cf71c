"""Results of pressing a tyre on the road, whichever solver ran: the patch at each load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .failure import EvaluationFailed

Array = np.ndarray
BALANCE = 0.01  # of the load, by which the road's force may differ from it


@dataclass(frozen=True)
class Footprint:
    """The tyre at one load.

    road_N: resultant of the contact pressure; rim_N (3,): reaction at the rim: down, then along y
    (the axle) and z; deflection_m: of the axle since the tyre was free; stiffness_N_per_m: tangent
    d force / d deflection. Of each node of the patch (p,): ``ring`` (place among the angles) and
    ``node`` (deck number), along_m and across_m in the road, pressure_Pa, area_m2, which it stands
    for, traction_Pa (p, 2). displacement (ring, node, 3): r, theta, z at the reference angle, m.
    contact_area_m2, contact_length_m, contact_width_m: of a solver that places the patch's edge
    between nodes, else None; then nodes beside the patch have a share of it, too.

    Of modes, where they were asked for: mode_frequency_Hz (m,); mode_shape (m, ring, j, 3), as
    displacement, at the nodes mode_node (j,) only. Of a road with friction, in which these modes
    stick: mode_traction_N (m,), the patch's forces along the road in each shape, their sizes
    summed; and the modes of a patch that slides freely, sliding_frequency_Hz and sliding_shape.
    With a gas in the cavity: cavity_Hz (2,), its first wave fore and aft, and up and down, between
    rigid walls. slopes: by variable and name, derivatives of the numbers above by those variables
    that it was asked for.
    """

    load_N: float
    road_N: float
    rim_N: Array
    deflection_m: float
    stiffness_N_per_m: float
    ring: Array
    node: Array
    along_m: Array
    across_m: Array
    pressure_Pa: Array
    area_m2: Array
    traction_Pa: Array
    displacement: Array
    contact_area_m2: float | None = None
    contact_length_m: float | None = None
    contact_width_m: float | None = None
    mode_frequency_Hz: Array | None = None
    mode_node: Array | None = None
    mode_shape: Array | None = None
    mode_traction_N: Array | None = None
    sliding_frequency_Hz: Array | None = None
    sliding_shape: Array | None = None
    cavity_Hz: Array | None = None
    slopes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Pressed:
    """One design at rising loads.

    nodes (n,): deck numbers; points (n, 2): R, Z in m, not inflated; angles (k,): of the rings,
    rad from the patch's middle, 0 <= angle < 2 pi; free_radius_m: inflated, without a load;
    inflated (n, 3): the displacement without a load, m, of a solver that tells it.
    failed: why the load after the last footprint was not reached, or None. cavity_Hz: of the first
    wave in the cavity before any load, where there is a gas.
    """

    pressure_kPa: float
    mass_kg: float
    nodes: Array
    points: Array
    angles: Array
    free_radius_m: float
    footprints: tuple[Footprint, ...]
    failed: EvaluationFailed | None = None
    cavity_Hz: float | None = None
    inflated: Array | None = None


def pressed(
    answer: dict[str, Any], loads_N: Sequence[float], kept: Path | None, modes: int = 0
) -> Pressed:
    """A solver's answer to ``loads_N``, of a run ``kept`` there, with so many ``modes`` at each.

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
        inflated=answer.get("inflated"),
    )


def _plain(value: Any) -> Any:
    """Arrays laid out alike, so that sums are too, recorded or not; numbers as floats."""
    if isinstance(value, Mapping):
        return value
    return np.ascontiguousarray(value) if np.ndim(value) else float(value)
