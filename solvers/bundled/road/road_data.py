"""Data of a job for the road: contact, modes there and the tangents of its numbers. They are plain
data, so that a tyre that is not pressed needs nothing else of the road."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...language.text import Block, DeckError
from ..deck.request import ResponseRequest
from ..section.band import Numbering
from ..section.model import Model
from ..section.parts.part import TyrePart
from ..section.parts.pressure import Pressure

Array = np.ndarray
MIN_ELASTIC_SLIP = 1e-6  # m, before friction is full: harder sticks are not reached
ROAD_NUMBERS = ("stiffness", "friction")  # of a `FlatRoad`


@dataclass(frozen=True)
class RoadData:
    """Road and contact data of a deck."""

    node: str  # its reference node
    tread: str  # the tread's surface
    stiffness: complex | float  # of the overclosure, Pa/m
    friction: complex | float  # coefficient
    elastic_slip: float  # m
    lengths: Array  # of the elements round half the tyre, from the road to the top, rad


@dataclass(frozen=True)
class ModeRequest:
    """Modes wanted at a load."""

    model: Model  # with the moduli of the vibration
    count: int
    nodes: Array  # (k,) rows of the section at which their shapes are wanted
    wheel_kg: float | None = None  # of a wheel that is free along the load
    # in place of modes: responses to a force on the tread, as `deck.request` has them
    response: ResponseRequest | None = None


@dataclass(frozen=True)
class RimRequest:
    """Reactions wanted at a load while the patch is held."""

    motions: Array  # (m, 6) of the rim along and about the deck's axes, m and rad
    reference_z: float  # place on the axle of the node that they are of, m


@dataclass(frozen=True)
class LoadRequest:
    """Results wanted at a load in addition to the footprint; None: none."""

    modes: ModeRequest | None = None
    rim: RimRequest | None = None


@dataclass(frozen=True)
class TyreToPress:
    """The inflated tyre that a road presses."""

    model: Model
    equations: Numbering
    loads: list[Pressure]
    U: Array  # (n, 3), m


def read_road(model: list[Block]) -> RoadData | None:
    """The road of a revolve job's model, or None where it has none. Raises DeckError."""
    pairs = [k for k in model if k.name == "CONTACT PAIR"]
    if not pairs:
        return None
    pair = pairs[0]
    if len(pairs) > 1:
        raise DeckError(pairs[1].place, "one *CONTACT PAIR is honoured, of the tread and the road")
    tread, surface = (pair.only_row().name(i) for i in (0, 1))
    bodies = [k for k in model if k.name == "RIGID BODY" and k.get("ANALYTICAL SURFACE") == surface]
    roads = [k for k in model if k.name == "SURFACE" and k.get("NAME") == surface]
    if not bodies or not roads:
        raise DeckError(pair.place, f"{surface} is no analytical surface of a *RIGID BODY")
    _check_flat(roads[0])
    blocks = _interaction(model, pair)
    if len(blocks) < 2:
        raise DeckError(pair.place, "the contact needs a *SURFACE BEHAVIOR and a *FRICTION")
    stiffness = blocks["SURFACE BEHAVIOR"].only_row().value(0)
    friction = blocks["FRICTION"].only_row().value(0)
    slip = float(np.real(blocks["FRICTION"].number("ELASTIC SLIP") or 0.0))
    if not (np.real(stiffness) > 0 and np.real(friction) >= 0 and slip >= MIN_ELASTIC_SLIP):
        raise DeckError(
            blocks["FRICTION"].place,
            "the contact's stiffness must be positive, friction not negative, the elastic slip at"
            f" least {MIN_ELASTIC_SLIP:g} m",
        )
    return RoadData(
        bodies[0].need("REF NODE"), tread, stiffness, friction, slip, _half_lengths(model)
    )


def _interaction(model: list[Block], pair: Block) -> dict[str, Block]:
    """Properties of the pair's contact by keyword. Raises DeckError."""
    name, owner, blocks = pair.need("INTERACTION"), "", dict[str, Block]()
    if not any(k.name == "SURFACE INTERACTION" and k.get("NAME") == name for k in model):
        raise DeckError(pair.place, f"the surface interaction {name} is not defined")
    for k in model:
        if k.name == "SURFACE INTERACTION":
            owner = k.get("NAME")
        elif k.name in ("SURFACE BEHAVIOR", "FRICTION") and owner == name:
            blocks[k.name] = k
    return blocks


def _check_flat(surface: Block) -> None:
    """Check that the road is a line along the axle, swept along the rolling direction, at one
    distance from the axle. Raises DeckError."""
    rows = surface.rows
    if surface.get("TYPE") != "CYLINDER" or len(rows) != 4:
        raise DeckError(surface.place, "the road is an analytical surface of TYPE=CYLINDER")
    # rows: origin and a point along the line; a point along the sweep; the line's two ends
    axes = [rows[0].number(i) for i in range(6)]
    sweep = [rows[1].number(i) for i in range(3)]
    H = axes[0]
    flat = axes == [H, 0.0, 0.0, H, 1.0, 0.0] and sweep == [H, 0.0, -1.0] and H > 0
    straight = [rows[2].name(0), rows[3].name(0)] == ["START", "LINE"]
    level = not (rows[2].value(2) or rows[3].value(2))
    if not (flat and straight and level):
        raise DeckError(surface.place, "only a flat road across the first axis is honoured")


def _half_lengths(model: list[Block]) -> Array:
    """Lengths (rad) of the elements from the road's side to the top. Raises DeckError."""
    generation = next(k for k in model if k.name == "SYMMETRIC MODEL GENERATION")
    lengths: list[float] = []
    for row in generation.rows[2:]:  # of each segment: degrees, elements, bias
        count = row.integer(1)
        if row.value(2, 1.0) != 1.0:
            raise DeckError(row.place, "a bias of the elements' lengths is not honoured")
        lengths += [row.number(0) / count] * count
    half = np.array(lengths[: len(lengths) // 2])
    if len(lengths) % 2 or not np.allclose(half, lengths[: len(half) - 1 : -1]):
        raise DeckError(
            generation.place, "the elements round a pressed tyre must mirror at 180 degrees"
        )
    if len(half) < 2:
        raise DeckError(
            generation.place, "a pressed tyre needs four elements round its circumference at least"
        )
    return np.radians(half)


@dataclass(frozen=True)
class InflatedTangent:
    """The inflated tyre and its road with the tangent of a number of the deck."""

    model: Model  # its numbers are complex
    loads: Sequence[TyrePart]
    U: Array  # dU/dp (n, 3) of the inflated state
    road: Mapping[str, float]  # d / dp of `ROAD_NUMBERS`
