"""Steps of a pair of jobs: procedure, loads and supports of each, and what must agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...language.text import WHOLE_DECK, Block, DeckError, Row, read_keywords, seed
from . import grammar

PROCEDURES = ("STATIC", "FREQUENCY", "COMPLEX FREQUENCY")
Tangent = tuple[str, int, int, float]  # job, 1-based line, 0-based field, d number / d variable


@dataclass
class DeckStep:
    """One step with what holds in it; loads and supports carry on from step to step of a job."""

    number: int  # in the job, from 1
    procedure: Block  # its keyword of ``PROCEDURES``
    pressures: dict[str, complex | float]  # surface to the deck's number, Pa
    held: Sequence[Row]  # rows of *BOUNDARY
    long_term: bool  # the static state is relaxed
    revolved: bool  # of the second job, in three dimensions
    forces: Sequence[Row]  # rows of *CLOAD
    output: str  # the node set of its *NODE FILE, or ""
    centrifugal: dict[str, complex | float]  # element set to Omega^2 (rad2/s2) of *DLOAD's CENTRIF
    spin: dict[str, complex | float]  # element set to Omega (rad/s) of its ROTDYNF
    is_perturbation: bool = False  # a *STATIC that is linear about the end of the step before

    @property
    def pressure(self) -> float:
        """The largest pressure, Pa."""
        return max((float(np.real(p)) for p in self.pressures.values()), default=0.0)


class Deck:
    """A section job, and the job that revolves it or None, as keyword blocks.

    Raises DeckError.
    """

    def __init__(self, texts: dict[str, str], job: str, oldjob: str | None):
        self.jobs = [oldjob, job] if oldjob else [job]
        self._keywords = {name: read_keywords(texts[name], name) for name in self.jobs}
        for k in [] if oldjob else self._keywords[job]:
            if k.name == "SYMMETRIC MODEL GENERATION":
                raise DeckError(k.place, "this job revolves a section job: name that with --oldjob")

    def read(self, tangents: list[Tangent]) -> tuple[list[Block], list[Block], list[DeckStep]]:
        """Model blocks of the section job and of the one that revolves it (none: empty), and all
        steps, their numbers carrying ``tangents``."""
        models: list[list[Block]] = []
        steps = []
        for place, name in enumerate(self.jobs):
            own = [(line, index, value) for job, line, index, value in tangents if job == name]
            keywords = self._keywords[name]
            model, blocks = grammar.check(seed(keywords, own) if own else keywords, place > 0)
            models.append(model)
            steps.append(_steps(model, blocks, place > 0))
        if len(models) > 1:
            _check_transfer(models[0], steps[0], models[1])
        revolve = models[1] if len(models) > 1 else []
        return models[0], revolve, [step for part in steps for step in part]


def _steps(model: list[Block], blocks: list[list[Block]], revolved: bool) -> list[DeckStep]:
    """The steps of a deck, each with all supports and loads that act in it. Raises DeckError."""
    steps: list[DeckStep] = []
    held: Sequence[Row] = [row for k in model if k.name == "BOUNDARY" for row in k.rows]
    pressures: dict[str, complex | float] = {}
    forces: Sequence[Row] = []
    turning: dict[str, dict[str, complex | float]] = {"CENTRIF": {}, "ROTDYNF": {}}
    long_term, on_road = True, any(k.name == "CONTACT PAIR" for k in model)
    for number, block in enumerate(blocks, start=1):
        procedure = _procedure(block, on_road)
        is_perturbation = procedure.name == "STATIC" and "PERTURBATION" in block[0].parameters
        for k in block:
            if k.name == "BOUNDARY":
                held = k.rows if k.get("OP") == "NEW" else [*held, *k.rows]
            elif k.name == "CLOAD":
                forces = k.rows
            elif k.name == "DSLOAD":
                pressures = {**pressures, **_pressures(k)}
            elif k.name == "DLOAD":
                turning = _turning(k, turning, revolved)
        if procedure.name == "STATIC" and not is_perturbation:
            long_term = "LONG TERM" in procedure.parameters
        output = next((k.get("NSET") for k in block if k.name == "NODE FILE"), "")
        steps.append(
            DeckStep(
                number,
                procedure,
                pressures,
                held,
                long_term,
                revolved,
                forces,
                output,
                turning["CENTRIF"],
                turning["ROTDYNF"],
                is_perturbation,
            )
        )
    return steps


def _pressures(k: Block) -> dict[str, complex | float]:
    """Pressure (Pa) by surface of a *DSLOAD. Raises DeckError."""
    pressures = {}
    for row in k.rows:
        if row.name(1) != "P":
            raise DeckError(row.place, f"load type '{row.text(1)}' is not honoured, only P")
        pressures[row.name(0)] = row.value(2)
    return pressures


def _turning(
    k: Block, before: dict[str, dict[str, complex | float]], revolved: bool
) -> dict[str, dict[str, complex | float]]:
    """Loads of a tyre that turns about its axle, by kind and element set."""
    turning = {kind: dict(sets) for kind, sets in before.items()}
    for row in k.rows:
        kind = row.name(1)
        if kind not in (turning if revolved else ("CENTRIF",)):
            raise DeckError(row.place, f"load type '{row.text(1)}' of *DLOAD is not honoured here")
        axis = [row.value(i, 0.0) for i in range(3, 9)]
        if axis != ([0.0, 0.0, 0.0, 0.0, 1.0, 0.0] if revolved else [0.0] * 6):
            raise DeckError(row.place, "the tyre turns about its axle, 0, 0, 0 along 0, 1, 0")
        turning[kind][row.name(0)] = row.value(2)
    return turning


def _procedure(block: list[Block], on_road: bool) -> Block:
    """The procedure of a step; ``on_road``: of a job with a road, where a *STATIC may be linear.
    Raises DeckError."""
    procedures = [k for k in block if k.name in PROCEDURES]
    if len(procedures) != 1:
        raise DeckError(
            block[0].place, "a step needs one *STATIC, *FREQUENCY or *COMPLEX FREQUENCY"
        )
    procedure, given = procedures[0], block[0].parameters
    if procedure.name != "STATIC":
        return procedure
    if "PERTURBATION" in given and ("NLGEOM" in given or not on_road):
        words = "a *STATIC step is no linear PERTURBATION, except without NLGEOM on a road"
        raise DeckError(block[0].place, words)
    if "PERTURBATION" in given and (procedure.rows or procedure.parameters):
        raise DeckError(procedure.place, "*STATIC takes no data and parameters in a PERTURBATION")
    if not {"NLGEOM", "PERTURBATION"} & given.keys():
        raise DeckError(block[0].place, "a *STATIC step needs NLGEOM=YES")
    return procedure


def _check_transfer(section: list[Block], steps: list[DeckStep], revolve: list[Block]) -> None:
    """The revolve job takes over the end of the section job's only step, and holds its rim."""
    blocks = {k.name: k for k in revolve}
    for needed in ("SYMMETRIC MODEL GENERATION", "SYMMETRIC RESULTS TRANSFER"):
        if needed not in blocks:
            place = revolve[0].place if revolve else WHOLE_DECK
            raise DeckError(place, f"a job that runs on another one needs *{needed}")
    generation, transfer = (
        blocks[f"SYMMETRIC {n}"] for n in ("MODEL GENERATION", "RESULTS TRANSFER")
    )
    if "REVOLVE" not in generation.parameters:
        raise DeckError(generation.place, "the job must REVOLVE the section")
    segments = [row.number(0) for row in generation.rows[2:]]
    if not abs(sum(segments) - 360.0) < 1e-6:
        raise DeckError(generation.place, "the tyre is revolved by 360 degrees")
    axis = [generation.rows[0].value(i, 0.0) for i in range(6)]
    if any(axis[:4]) or axis[5] or not np.real(axis[4]) > 0:
        raise DeckError(
            generation.place, "the tyre is revolved about the second axis, 0, 0, 0 to 0, 1, 0"
        )
    if len(steps) != 1 or steps[0].procedure.name != "STATIC":
        raise DeckError(transfer.place, "the first job must have one step, a *STATIC")
    increments = _increments(steps[0].procedure)
    if (transfer.need("STEP"), transfer.need("INC")) != ("1", str(increments)):
        raise DeckError(transfer.place, f"the first job ends with STEP=1, INC={increments}")
    for k in section:
        restated = (
            r.get("TIE NSET") == k.need("TIE NSET") for r in revolve if r.name == "RIGID BODY"
        )
        if k.name == "RIGID BODY" and not any(restated):
            raise DeckError(
                transfer.place,
                f"a revolve drops the *RIGID BODY of {k.need('TIE NSET')}: it must be restated",
            )


def _increments(procedure: Block) -> int:
    if "DIRECT" not in procedure.parameters:
        raise DeckError(procedure.place, "the increments must be fixed (DIRECT) for a transfer")
    row = procedure.only_row()
    return int(np.ceil(np.real(row.value(1) / row.value(0)) - 1e-9))
