"""The job that presses the inflated tyre on the road: the deck's requests, its steps, its results.

JOB.json: pressure_Pa, mass_kg, free_radius_m, failure, cause, ``footprints`` [load_N, road_N, rim_N
(x down, y, z), deflection_m, stiffness_N_per_m, contact_area_m2]; where a request has sensitivities
``slopes``, by variable those of numbers, and in JOB.npz those of the displacement as
displacement_slopes (variable, ring, node, 3); with a gas cavity_Hz of the
cavity's first wave, free and in ``footprints`` (fore-aft, vertical). JOB.npz: nodes, points, angles
of the whole tyre, and per footprint i the arrays of its patch
and the displacement, as NAME_i; where modes were asked for: mode_frequency_Hz (m,), mode_shape
(m, ring, node, 3) at mode_node, modal mass 1 kg; where a material has a loss factor
mode_damping_ratio (m,); with friction the patch's forces along the road in
these, mode_traction_N (m,), their sizes summed, and sliding_frequency_Hz, sliding_shape of the same
tyre while nothing holds the patch along the road. Where a response was asked for in place of
modes: response_NAME, the fields of `ResponseResult` and of `Superelement`.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ...errors import Refused, RunFailed
from ...language.text import WHOLE_DECK, DeckError
from ..modes.harmonics import Vibration, lowest_of_all
from ..modes.response import tread_patch
from ..section.band import Numbering
from ..section.model import Model
from ..section.parts.elastic import Elastic
from ..section.parts.rubber import Hourglass
from ..solid3d.circumference import WAVE_BY_ELEMENTS, HalfCircle, half_circle, waves_beyond
from ..solid3d.revolved import Revolved
from .contact import flat_road
from .contact_newton import ContactNewton, PressedState
from .half_turn_symmetry import HalfTurn
from .loaded_modes import SPARE, TyreOnRoad, hold_of_patch, loaded_modes
from .patch import patch
from .pressed_response import UNLOADED_MODES, PressedLosses, PressedResponse
from .rim_stiffness import reactions, rim_stiffness
from .road_data import InflatedTangent, LoadRequest, ModeRequest, RimRequest, RoadData, TyreToPress
from .slopes import Slopes
from .tread import tread_of

Array = np.ndarray
log = logging.getLogger("tyrecal_solvers")
PATCH_ARRAYS = ("ring", "node", "along_m", "across_m", "pressure_Pa", "area_m2", "traction_Pa")
RESPONSE = "response_"  # begins the names of arrays of a response
MODE_ARRAYS = (
    *("mode_frequency_Hz", "mode_node", "mode_shape", "mode_damping_ratio"),
    *("mode_traction_N", "sliding_frequency_Hz", "sliding_shape"),
)
FIELDS = (*PATCH_ARRAYS, "displacement", "displacement_slopes", "rim_reactions", *MODE_ARRAYS)


def press(
    inflated: TyreToPress,
    data: RoadData,
    requests: Mapping[float, LoadRequest],
    check: Callable[[], None],
    tangents: Mapping[str, InflatedTangent] = MappingProxyType({}),
    begin: Callable[[ContactNewton, Array], None] | None = None,
) -> dict[str, Any]:
    """Footprints at the loads (N) of ``requests``, which rise, with what is requested there, and
    derivatives by the numbers of the deck that ``tangents`` are of; ``begin`` gives loads
    their guesses, from the deck's node numbers (n,).

    Raises DeckError; RunFailed where not even the first load is reached.
    """
    model, equations, U = inflated.model, inflated.equations, inflated.U
    by_elements = half_circle(data.lengths)
    rings = by_elements.angles
    waves = any(each.modes or each.rim for each in requests.values())
    around = waves_beyond(data.lengths) if waves else by_elements
    if data.tread not in model.mesh.faces:
        raise DeckError(WHOLE_DECK, f"surface {data.tread} is not defined in the section's job")
    if any(isinstance(p, Elastic) and isinstance(p.law, Hourglass) for p in model.parts):
        raise DeckError(
            WHOLE_DECK,
            "CGAX4R cannot be pressed on a road, its hourglass stiffness does not hold short waves"
            " round the circumference: take CGAX8R",
        )
    tread = model.mesh.faces[data.tread]
    tyre, start = Revolved(model, inflated.loads, around), np.multiply.outer(around.turn(0).real, U)
    surface = tread_of(model.mesh.X, tread.connectivity, around)
    law = float(np.real(data.stiffness)), float(np.real(data.friction)), data.elastic_slip
    road = flat_road(model.mesh.X, surface, *law, start)
    slopes = Slopes(tangents, around, tread.connectivity, road)
    try:
        symmetry = HalfTurn(model.mesh, equations.equation < equations.size, around)
        work = ContactNewton(tyre, symmetry, road, start, check, slopes.follow, slopes.wanted)
    except Refused as error:
        raise DeckError(WHOLE_DECK, f"a pressed tyre must be symmetric: {error}") from None
    if begin:
        begin(work, np.array(list(model.mesh.index)))
    footprints: list[dict[str, Any]] = []
    failure = cause = ""
    for load, request in requests.items():
        try:
            state = work.to(load)
            footprint = _footprint(work, state, load, rings)
            footprint |= slopes.at(work, state, rings)
            if request.rim:
                footprint |= _rim_reactions(work, state, request.rim)
            if request.modes:
                vibrating = _response if request.modes.response else _modes
                footprint |= vibrating(work, state, request.modes, equations, U, rings)
        except (RunFailed, np.linalg.LinAlgError) as error:
            cause = getattr(error, "cause", "crashed")
            if cause == "timed_out":
                error = RunFailed(cause, f"{error}{work.progress()}")
            if not footprints:
                raise error from None
            failure = str(error)
            break
        footprints.append(footprint)
        reached = len(footprints), len(requests)
        log.info("load %d of %d is reached: %g N", *reached, load, extra={"loads": reached})
    return {
        "free_radius_m": work.free_radius,
        "angles": np.concatenate([rings, 2 * np.pi - rings[-2:0:-1]]),
        "footprints": footprints,
        "failure": failure,
        "cause": cause,
    }


def _footprint(
    work: ContactNewton, state: PressedState, load: float, angles: Array
) -> dict[str, Any]:
    """One load's results on the whole tyre, whose other half is this one's half turn; ``angles``
    of the rings."""
    symmetry = work.symmetry
    U = symmetry.spread(state.parts)
    contact = state.contact
    other = symmetry.other
    displacement = symmetry.whole(U, angles)
    half = patch(contact, work.tyre.model.mesh.X, angles)
    size, force = half.area.copy(), half.force.copy()
    # ring 0 belongs to both halves: each node there meets its own image
    size[0] += half.area[0, other]
    force[0] += half.force[0, other] * [1.0, -1.0, -1.0]
    rings, nodes = np.nonzero(size)
    size, force = size[rings, nodes], force[rings, nodes]
    again = rings > 0
    ring = np.concatenate([rings, (2 * (len(angles) - 1) - rings)[again]])
    both = lambda a, sign=1.0: np.concatenate([a, sign * a[again]])
    angle, X = angles[rings], work.tyre.model.mesh.X
    u = displacement[rings, nodes]
    along = np.sin(angle) * (X[nodes, 0] + u[:, 0]) + np.cos(angle) * u[:, 1]
    across = X[nodes, 1] + u[:, 2]
    residual = work.tyre.residual(U)
    held = ~symmetry.free
    turn = symmetry.around.turn(1)[:, None]
    at_rim = residual * held
    # the half turn cancels what the two halves bear along and across
    down = float((turn.real * at_rim[..., 0] - turn.imag * at_rim[..., 1]).sum())
    return {
        "load_N": load,
        "road_N": contact.force,
        "rim_N": np.array([2 * down, 0.0, 0.0]),
        "deflection_m": work.free_radius - state.height,
        "stiffness_N_per_m": state.stiffness,
        "ring": ring,
        "node": np.concatenate([nodes, other[nodes][again]]),
        "along_m": both(along, -1.0),
        "across_m": both(across, -1.0),
        "area_m2": both(size),
        "contact_area_m2": 2 * float(half.area.sum()),
        "contact_length_m": half.length,
        "contact_width_m": half.width,
        "pressure_Pa": both(force[:, 0] / size),
        "traction_Pa": both(force[:, 1:] / size[:, None], -1.0),
        "displacement": displacement,
    }


def _pressed(work: ContactNewton, state: PressedState, tyre: Revolved) -> TyreOnRoad:
    """The tyre about one load, held there by the forces on the tyre that was pressed."""
    U = work.symmetry.spread(state.parts)
    return TyreOnRoad(tyre, work.symmetry, U, work.tyre.residual(U), work.check)


def _rim_reactions(
    work: ContactNewton, state: PressedState, wanted: RimRequest
) -> dict[str, Array]:
    """Reactions to motions of the rim about one load, with the patch held."""
    pressed = _pressed(work, state, work.tyre)
    hold = hold_of_patch(state.contact)
    C = rim_stiffness(pressed, hold, wanted.reference_z, work.release_factor())
    return {"rim_reactions": reactions(C, wanted.motions)}


def _modes(
    work: ContactNewton,
    state: PressedState,
    wanted: ModeRequest,
    equations: Numbering,
    inflated: Array,
    angles: Array,
) -> dict[str, Array]:
    """The whole tyre's modes about one load, their shapes at the wanted nodes of the rings."""
    tyre = Revolved(wanted.model, work.tyre.loads, work.tyre.around)
    pressed = _pressed(work, state, tyre)
    road = state.contact.road
    smooth = replace(state.contact, road=replace(road, friction=0.0))
    holds = [hold_of_patch(each) for each in (state.contact, smooth)]
    holds = holds if road.friction else holds[:1]
    vibration = Vibration(wanted.model, inflated, tyre.loads, equations, 0.0)
    start = lowest_of_all(vibration, wanted.count + 2 * SPARE, work.check)
    modes = loaded_modes(pressed, holds, start, wanted.count, wanted.wheel_kg, work.release_factor)
    arrays = {"mode_node": wanted.nodes}
    symmetries = {parity: work.symmetry.of_parity(parity) for parity in (1, -1)}
    for name, each in zip(("mode", "sliding"), modes, strict=False):
        whole = np.array(
            [
                symmetries[parity].whole(shape, angles)
                for parity, shape in zip(each.parity, each.shapes, strict=True)
            ]
        )
        arrays[f"{name}_frequency_Hz"] = np.sqrt(each.eigenvalues) / (2 * np.pi)
        arrays[f"{name}_shape"] = whole[:, :, wanted.nodes]
    if wanted.model.lossy:
        arrays["mode_damping_ratio"] = PressedLosses(tyre, pressed.U).damping_ratios(modes[0])
    if road.friction:
        arrays["mode_traction_N"] = np.array(
            [
                _traction(work.symmetry.around, (holds[0] @ V.ravel()).reshape(V.shape))
                for V in modes[0].shapes
            ]
        )
    return arrays


def _response(
    work: ContactNewton,
    state: PressedState,
    wanted: ModeRequest,
    equations: Numbering,
    inflated: Array,
    angles: Array,
) -> dict[str, Array]:
    """Response of the whole tyre about one load to forces on its tread, as arrays by name."""
    request = wanted.response
    assert request is not None
    tyre = Revolved(wanted.model, work.tyre.loads, work.tyre.around)
    lowest, highest = request.lowest_Hz, request.highest_Hz
    excited, seen = request.points()
    vibration = Vibration(wanted.model, inflated, tyre.loads, equations, 0.0)
    response = PressedResponse(
        _pressed(work, state, tyre),
        hold_of_patch(state.contact),
        lowest_of_all(vibration, UNLOADED_MODES, work.check),
        tread_patch(wanted.model.mesh.X, inflated, wanted.nodes, request.patch_m),
        [*excited, *seen],
        highest,
        work.release_factor() if wanted.model is work.tyre.model else None,
    )
    frequencies = np.linspace(lowest, highest, request.lines)
    harmonics = 1 + int(WAVE_BY_ELEMENTS / (2 * np.diff(angles).max()) + 1e-9)
    result = response.result(frequencies, len(excited), harmonics)
    arrays = {name: each for name, each in vars(result).items() if name != "matrices"}
    if request.modes:
        arrays |= vars(response.superelement(request.modes, len(excited)))
    return {f"{RESPONSE}{name}": np.asarray(each) for name, each in arrays.items()}


def _traction(around: HalfCircle, forces: Array) -> float:
    """Sum of the sizes of nodal forces (k, n, 3) along the road, of the whole tyre, N."""
    nodes = len(around.angles)
    c, s = np.cos(around.angles)[:, None], np.sin(around.angles)[:, None]
    r, theta, z = np.moveaxis(forces[:nodes], -1, 0)
    return 2 * float(np.hypot(s * r + c * theta, z).sum())


def write(stem: Path, model: Model, result: dict[str, Any]) -> None:
    """Write STEM.json and STEM.npz."""
    numbers = np.array(list(model.mesh.index))
    arrays: dict[str, Any] = {"nodes": numbers, "points": model.mesh.X}
    arrays["angles"] = result["angles"]
    lines = []
    for i, footprint in enumerate(result["footprints"]):
        footprint = {**footprint, "node": numbers[footprint["node"]]}
        if "mode_node" in footprint:
            footprint["mode_node"] = numbers[footprint["mode_node"]]
        responses = [name for name in footprint if name.startswith(RESPONSE)]
        for name in (*FIELDS, *responses):
            if name in footprint:
                arrays[f"{name}_{i}"] = footprint.pop(name)
        lines.append({**footprint, "rim_N": footprint["rim_N"].tolist()})
    with stem.with_name(stem.name + ".npz").open("wb") as file:
        np.savez(file, **arrays)
    plain = {k: v for k, v in result.items() if k not in arrays}
    text = json.dumps({"format": 1, **plain, "footprints": lines}, indent=1)
    stem.with_name(stem.name + ".json").write_text(text + "\n", encoding="utf-8", newline="")


def read(stem: Path) -> dict[str, Any]:
    """Read the results that `write` wrote, as plain data."""
    answer: dict[str, Any] = json.loads(
        stem.with_name(stem.name + ".json").read_text(encoding="utf-8")
    )
    with np.load(stem.with_name(stem.name + ".npz"), allow_pickle=False) as arrays:
        for name in ("nodes", "points", "angles"):
            answer[name] = arrays[name]
        for i, footprint in enumerate(answer["footprints"]):
            footprint["rim_N"] = np.array(footprint["rim_N"])
            for name in FIELDS:
                if f"{name}_{i}" in arrays:
                    footprint[name] = arrays[f"{name}_{i}"]
            of_response = [name for name in arrays if name.startswith(RESPONSE)]
            if response := {
                name.removeprefix(RESPONSE).removesuffix(f"_{i}"): arrays[name]
                for name in of_response
                if name.endswith(f"_{i}")
            }:
                footprint["response"] = response
    del answer["format"]
    if not answer["cause"]:
        del answer["cause"]
    return answer
