"""Form that an answer must have, of a solver's run or of a record; checked before it is believed.

`check` judges an answer or a recorded failure by itself, `contradiction` an answer by what was
asked. `Evaluator` makes a typed failure of a run's wrong answer, and sets a wrong record aside.
The axes of arrays: `Solver.read`, under load `Footprint`. A number is above ``least``, not equal.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from math import isclose
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from ..deck.decks import Decks
from . import answer_fields as of
from .pressed import Footprint
from .record import Damaged

NODE_TOLERANCE = 1e-4  # of the largest coordinate: solvers write six digits
NODE_BLOCK = re.compile(
    r"^\*NODE *(?:,[^\n]*)?\n((?:[^*\n][^\n]*\n)+)", re.MULTILINE | re.IGNORECASE
)
GENERATED = re.compile(
    r"^\*(?:NGEN|NFILL|NCOPY|NMAP|SYSTEM|INCLUDE)\b", re.MULTILINE | re.IGNORECASE
)


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, defer_build=True)  # built by who reads one


class _Failure(_Part):
    """A failure that another run would repeat; the fields of `EvaluationFailed`."""

    cause: Literal["no_equilibrium", "unstable"]  # the deck's own doing, see `evaluator.SETTLED`
    words: Annotated[str, Field(max_length=100_000)]
    folder: Annotated[str, Field(max_length=4096)] | None


class _Mode(_Part):
    """A mode as `Solver.read` gives it: on the section, with its harmonic and amplitude, or in
    three dimensions, with its displacement."""

    frequency_Hz: of.Hertz
    multiplicity: Annotated[Any, of.shaped("iu", least=0, most=2)]  # 1, or 2: both of a pair
    n: Annotated[Any, of.shaped("iu", least=-1)] = 0  # harmonic of the amplitude: 0, 1, ...
    # (points, 3) along r, theta, z
    amplitude: Annotated[Any, of.shaped("c" + of.REAL, None, 3)] = None
    # (points, 3) along r, theta, z; NaN where the solver does not give it
    displacement: Annotated[Any, of.shaped(of.REAL, None, 3, nan=True)] = None
    members: of.HertzPair | None = None  # of a pair that is split, see `RawMode`
    damping_ratio: of.Finite | None = None

    @property
    def points(self) -> int:
        """Number of points that the shape is known at, -1 without a shape."""
        shape = self.displacement if self.amplitude is None else self.amplitude
        return -1 if shape is None else len(shape)

    @model_validator(mode="after")
    def _moves(self) -> Self:
        shape = self.displacement if self.amplitude is None else self.amplitude
        if shape is not None and not np.nan_to_num(shape).any():
            raise ValueError("a mode's shape is 0 at all points")
        return self


class _Tyre(_Part):
    """The fields that all answers have; k points."""

    pressure_Pa: Annotated[Any, of.shaped(of.REAL, least=-1e-9)]
    mass_kg: of.PositiveFinite
    nodes: of.WholeArray
    # uninflated: (k, 2) R, Z, or (k, 3) R, Theta, Z; m and rad
    points: Annotated[Any, of.shaped(of.REAL, None, None)]

    @model_validator(mode="after")
    def _span_a_section(self) -> Self:
        points = np.asarray(self.points)
        if not len(points) or not np.ptp(points, axis=0)[[0, -1]].all():
            raise ValueError("points do not span a section")
        return self


class _Response(_Part):
    """Responses to a force on the tread."""

    frequency_Hz: of.RealArray
    receptance: Annotated[Any, of.shaped("c", None, None, None)]  # (respond, excite, f)
    hub: Annotated[Any, of.shaped("c", 6, None, None)]  # (6, excite, f) forces and moments
    radius_m: of.PositiveFinite  # of the inflated tread
    harmonics: Annotated[Any, of.shaped("iu", least=0)]  # that were summed
    harmonics_wanted: Annotated[Any, of.shaped("iu", least=0)]  # for the patch's size
    # (d, d), d coordinates: motions of the rim, then modes; loss is the imaginary part of the
    # stiffness; tread (respond, d): motion of a point per coordinate
    stiffness: Annotated[Any, of.shaped("f", None, None)] = None
    mass: Annotated[Any, of.shaped("f", None, None)] = None
    loss: Annotated[Any, of.shaped("f", None, None)] = None
    tread: Annotated[Any, of.shaped("f", None, None)] = None


class _Modes(_Tyre):
    """An answer with m modes; see `Solver.read` and `Evaluation`."""

    modes: Annotated[list[_Mode], Field(min_length=1)]
    gradients: dict[str, of.RealArray]  # (m,) by variable, Hz per unit
    displacement: of.Vectors  # by the inflation, m; (0, 3) where the solver does not give it
    mass_gradients: dict[str, of.Finite] = Field(default_factory=dict)
    response: _Response | None = None

    @model_validator(mode="after")
    def _go_together(self) -> Self:
        count = len(self.points)
        flat = any(mode.amplitude is not None for mode in self.modes)
        if any(mode.points != count for mode in self.modes):
            raise ValueError("a mode's shape has not as many points as there are")
        if np.shape(self.points)[1] not in (2, 3) or (flat and len(self.nodes) != count):
            raise ValueError("nodes and points do not go together")
        if len(self.displacement) not in (0, count):
            raise ValueError("the inflation has not as many points as there are")
        if self.pressure_Pa > 0 and len(self.displacement) and not np.any(self.displacement):
            raise ValueError("the inflated tyre is where it was without pressure")
        if any(len(slopes) != len(self.modes) for slopes in self.gradients.values()):
            raise ValueError("not every mode has a sensitivity")
        return self


def _shape(array: Any) -> tuple[int, ...]:
    return np.shape(array)


class _Pressed(_Tyre):
    """An answer under loads; see `Solver.read` and `Pressed`."""

    angles: of.RealArray
    free_radius_m: of.PositiveFinite
    footprints: Annotated[list[Footprint], Field(min_length=1)]
    cavity_Hz: of.Hertz | None = None
    failure: Annotated[str, Field(max_length=100_000)]
    cause: Literal["no_equilibrium", "unstable"] = "no_equilibrium"

    @model_validator(mode="after")
    def _go_together(self) -> Self:
        rings, nodes = len(self.angles), len(self.points)
        for each in self.footprints:
            rows = ("node", "along_m", "across_m", "pressure_Pa", "area_m2", "traction_Pa")
            if any(len(getattr(each, name)) != len(each.ring) for name in rows):
                raise ValueError("a patch's lists do not go together")
            if np.shape(each.displacement)[:2] != (rings, nodes) or not (
                set(map(int, each.ring)) <= set(range(rings))
                and set(map(int, each.node)) <= set(map(int, self.nodes))
            ):
                raise ValueError("a patch is not on this tyre")
            moved = each.displacement_slopes
            if moved is not None and _shape(moved)[:3] != (len(each.slopes), rings, nodes):
                raise ValueError("sensitivities of a displacement are not this tyre's")
            if each.response is not None:
                _Response.model_validate(each.response)
            # (m,), (j,) and (m, ring, j, 3)
            parts = (each.mode_frequency_Hz, each.mode_node, each.mode_shape)
            if any(part is not None for part in parts):
                if any(part is None for part in parts):
                    raise ValueError("of modes under load a part is missing")
                if _shape(parts[2])[:3] != (*_shape(parts[0]), rings, *_shape(parts[1])):
                    raise ValueError("modes under load do not go together")
            damped = each.mode_damping_ratio
            if damped is not None and _shape(damped) != _shape(parts[0]):
                raise ValueError("modes under load and their damping do not go together")
            # (m,), and of the modes of a sliding patch frequencies and shapes, as above
            free = (each.mode_traction_N, each.sliding_frequency_Hz, each.sliding_shape)
            if any(part is not None for part in free) and not (
                all(part is not None for part in (*parts, *free))
                and _shape(free[0]) == _shape(parts[0])
                and _shape(free[2])[:3] == (*_shape(free[1]), *_shape(parts[2])[1:3])
            ):
                raise ValueError("modes of a sliding patch do not go together")
        return self


def check(content: Any) -> None:
    """Raises Damaged if ``content`` is not what `Evaluator` records: a failure's fields, or, under
    ``answer``, what `Solver.read` gave."""
    kind: type[_Part] = _Failure
    if isinstance(content, dict) and "answer" in content:
        content = content["answer"]
        kind = _Pressed if isinstance(content, dict) and "footprints" in content else _Modes
    try:
        kind.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"])) or "the whole"
        raise Damaged(f"{place}: {first['msg'].removeprefix('Value error, ')}") from None
    except (TypeError, ValueError) as error:  # NumPy's of what it cannot make an array of
        raise Damaged(str(error)) from None


def contradiction(answer: Mapping[str, Any], decks: Decks, folder: Path) -> str:
    """Why an answer that passed `check` is none to ``decks``, whose files are in ``folder``: its
    pressure, its harmonics, how many modes it has, its nodes. "" where nothing is wrong."""
    asked_kPa, request = decks.design.pressure_kPa, decks.request
    pressure_kPa = answer["pressure_Pa"] / 1e3
    if not isclose(pressure_kPa, asked_kPa, rel_tol=1e-6, abs_tol=1e-9):
        return f"it is of {pressure_kPa:g} kPa, {asked_kPa:g} kPa were requested"
    if "modes" in answer and "highest_harmonic" in request:
        highest, each = request["highest_harmonic"], request["modes_per_harmonic"]
        most = 2 * each * (highest + 1)  # of a solver that gives the two of a pair apart
        if len(answer["modes"]) > most:
            return f"it has {len(answer['modes'])} modes, {most} at most were requested"
        counts = Counter(int(mode["n"]) for mode in answer["modes"] if "amplitude" in mode)
        for n, count in sorted(counts.items()):
            if n > highest:
                return f"it has a mode of harmonic {n}, the highest requested is {highest}"
            if count > each:
                return f"it has {count} modes of harmonic {n}, {each} were requested"
    if wanted := request.get("response"):
        shape = len(wanted["respond"]), len(wanted["excite"]), wanted["lines"]
        for each in answer.get("footprints", [answer]):
            response = each.get("response", {})
            if _shape(response.get("receptance", 0)) != shape:
                return "it has not the responses that were requested"
            matrices = [response.get(name) for name in ("stiffness", "mass", "loss")]
            if "modes" in wanted and len({*map(_shape, matrices)} - {()}) != 1:
                return "it has not the matrices that were requested"
    return _other_nodes(answer, folder)


def _other_nodes(answer: Mapping[str, Any], folder: Path) -> str:
    """Why the nodes of an answer on the section are not those of the decks; "" where they are, or
    where a deck leaves its nodes to the solver to generate."""
    numbers, points = np.asarray(answer["nodes"]), np.asarray(answer["points"])
    if len(numbers) != len(points) or points.shape[1] != 2:
        return ""
    texts = [path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.inp"))]
    rows = [
        line.split(",")
        for text in texts
        for block in NODE_BLOCK.findall(text)
        for line in block.splitlines()
    ]
    if not rows or any(map(GENERATED.search, texts)):
        return ""
    # R and Z: of a section, and at the angle 0 of a sector in three dimensions, x and z
    places = {int(row[0]): (float(row[1]), float(row[-1])) for row in rows}
    unknown = [int(number) for number in numbers if int(number) not in places]
    if unknown:
        return f"node {unknown[0]} is not in the deck"
    off = abs(np.array([places[int(number)] for number in numbers]) - points).max(1)
    if off.max() > NODE_TOLERANCE * abs(points).max():
        return f"node {numbers[off.argmax()]} is not where the deck has it"
    return ""
