"""Steps of a pair of jobs: procedure, loads and supports of each, and what must agree.

`check` splits a job's deck into its model and its steps, and refuses by name what the table does
not list as honoured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...language.honour import check_honoured, split_steps
from ...language.text import WHOLE_DECK, Block, DeckError, Row, read_keywords, seed

PROCEDURES = ("STATIC", "FREQUENCY", "COMPLEX FREQUENCY")
Numbers = dict[str, complex | float]
Tangent = tuple[str, int, int, float]  # job, 1-based line, 0-based field, d number / d variable


def check(keywords: list[Block], revolve: bool) -> tuple[list[Block], list[list[Block]]]:
    """Split a job into its model and its steps, refusing what is not honoured. revolve: the job
    revolves a section job, else it is one. Raises DeckError naming the keyword or parameter and its
    line."""
    model, steps = split_steps(keywords)
    places = ["revolve" if revolve else "section", *["step"] * len(steps)]
    for place, blocks in zip(places, (model, *steps), strict=True):
        for block in blocks:
            check_honoured(block, place)
    formats = [keyword for keyword in keywords if keyword.name == "FILE FORMAT"]
    if len(formats) > 1:
        first = formats[0].place
        raise formats[1].refused(f"may be given once in a job: it is given in {first} already")
    return model, steps


@dataclass
class DeckStep:
    """One step with what holds in it; loads and supports carry on from step to step of a job."""

    number: int  # in the job, from 1
    procedure: Block  # its keyword of ``PROCEDURES``
    held: Sequence[Row]  # rows of *BOUNDARY: node or set, first and last freedom, value
    revolved: bool  # of the second job, in three dimensions
    output: str = ""  # the node set of its *NODE FILE, or ""
    is_perturbation: bool = False  # a *STATIC that is linear about the end of the step before
    long_term: bool = True  # the static state is relaxed
    forces: Sequence[Row] = ()  # rows of the last *CLOAD
    pressures: Numbers = field(default_factory=dict)  # surface to the deck's number, Pa
    centrifugal: Numbers = field(default_factory=dict)  # element set to Omega^2 of *DLOAD's CENTRIF
    spin: Numbers = field(default_factory=dict)  # element set to Omega (rad/s) of its ROTDYNF

    @property
    def pressure(self) -> float:
        """The largest pressure, Pa."""
        return max((float(np.real(p)) for p in self.pressures.values()), default=0.0)


class Deck:
    """A section job, and the job that revolves it or None, as keyword blocks. Raises DeckError."""

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
            # what carries tangents has been read and judged without
            model, blocks = split_steps(seed(keywords, own)) if own else check(keywords, place > 0)
            models.append(model)
            steps.append(_steps(model, blocks, place > 0))
        if len(models) > 1:
            _check_transfer(models[0], steps[0], models[1])
        section, revolve, *_ = *models, []
        return section, revolve, [step for part in steps for step in part]


def _steps(model: list[Block], blocks: list[list[Block]], revolved: bool) -> list[DeckStep]:
    """The steps of a deck, each with all supports and loads that act in it. Raises DeckError."""
    steps: list[DeckStep] = []
    held = [row for k in model if k.name == "BOUNDARY" for row in k.rows]
    on_road = any(k.name == "CONTACT PAIR" for k in model)
    step = DeckStep(0, Block("", WHOLE_DECK, {}), held, revolved)  # before the first one
    for number, block in enumerate(blocks, start=1):
        procedure = _procedure(block, on_road)
        output = next((k.get("NSET") for k in block if k.name == "NODE FILE"), "")
        linear = procedure.name == "STATIC" and "PERTURBATION" in block[0].parameters
        step = replace(
            step, number=number, procedure=procedure, output=output, is_perturbation=linear
        )
        for k in block:
            if k.name == "BOUNDARY":
                step.held = k.rows if k.get("OP") == "NEW" else [*step.held, *k.rows]
            elif k.name == "CLOAD":
                step.forces = k.rows
            elif k.name == "DSLOAD":
                step.pressures = step.pressures | _pressures(k)
            elif k.name == "DLOAD":
                _turn(step, k)
        if procedure.name == "STATIC" and not linear:
            step.long_term = "LONG TERM" in procedure.parameters
        steps.append(step)
    return steps


def _pressures(k: Block) -> Numbers:
    """Pressure (Pa) by surface of a *DSLOAD. Raises DeckError."""
    pressures = {}
    for row in k.rows:
        if row.name(1) != "P":
            raise k.refused(f"the load '{row.text(1)}' is not honoured, only P", row)
        pressures[row.name(0)] = row.value(2)
    return pressures


def _turn(step: DeckStep, k: Block) -> None:
    """Add the loads of a tyre that turns about its axle, of a *DLOAD. Raises DeckError."""
    step.centrifugal, step.spin = dict(step.centrifugal), dict(step.spin)
    kinds = {"CENTRIF": step.centrifugal} | ({"ROTDYNF": step.spin} if step.revolved else {})
    for row in k.rows:
        kind = row.name(1)
        if kind not in kinds:
            raise k.refused(f"the load '{row.text(1)}' is not honoured here", row)
        axis = [row.value(i, 0.0) for i in range(3, 9)]  # a point of it, its direction
        if axis != ([0.0, 0.0, 0.0, 0.0, 1.0, 0.0] if step.revolved else [0.0] * 6):
            raise k.refused("the tyre turns about its axle, 0, 0, 0 along 0, 1, 0", row)
        kinds[kind][row.name(0)] = row.value(2)


def _procedure(block: list[Block], on_road: bool) -> Block:
    """The procedure of a step; ``on_road``: of a job with a road, where a *STATIC may be linear.
    Raises DeckError."""
    procedures = [k for k in block if k.name in PROCEDURES]
    if len(procedures) != 1:
        raise block[0].refused("needs one *STATIC, *FREQUENCY or *COMPLEX FREQUENCY")
    procedure, given = procedures[0], block[0].parameters
    if procedure.name != "STATIC":
        return procedure
    if "PERTURBATION" in given and ("NLGEOM" in given or not on_road):
        words = "a *STATIC is no linear PERTURBATION, except without NLGEOM on a road"
        raise block[0].refused(words)
    if "PERTURBATION" in given and (procedure.rows or procedure.parameters):
        raise procedure.refused("takes no data and parameters in a PERTURBATION")
    if not {"NLGEOM", "PERTURBATION"} & given.keys():
        raise block[0].refused("a *STATIC needs NLGEOM=YES")
    return procedure


def _check_transfer(section: list[Block], steps: list[DeckStep], revolve: list[Block]) -> None:
    """The revolve job takes over the end of the section job's only step, and holds its rim. Raises
    DeckError."""
    blocks = {k.name: k for k in revolve}
    names = "SYMMETRIC MODEL GENERATION", "SYMMETRIC RESULTS TRANSFER"
    for needed in names:
        if needed not in blocks:
            place = revolve[0].place if revolve else WHOLE_DECK
            raise DeckError(place, f"a job that runs on another one needs *{needed}")
    generation, transfer = (blocks[name] for name in names)
    if "REVOLVE" not in generation.parameters:
        raise generation.refused("must REVOLVE the section")
    # rows: two points of the axis; one of the section's plane; segments: degrees, elements, bias
    segments = [row.number(0) for row in generation.rows[2:]]
    if not abs(sum(segments) - 360.0) < 1e-6:
        raise generation.refused("the tyre is revolved by 360 degrees")
    axis = [generation.rows[0].value(i, 0.0) for i in range(6)]
    if any(axis[:4]) or axis[5] or not np.real(axis[4]) > 0:
        raise generation.refused("the tyre is revolved about the second axis, 0, 0, 0 to 0, 1, 0")
    if len(steps) != 1 or steps[0].procedure.name != "STATIC":
        raise transfer.refused("the first job must have one step, a *STATIC")
    static = steps[0].procedure
    if "DIRECT" not in static.parameters:
        raise static.refused("the increments must be fixed (DIRECT) for a transfer")
    row = static.only_row()  # first increment, period
    increments = int(np.ceil(np.real(row.value(1) / row.value(0)) - 1e-9))
    if (transfer.need("STEP"), transfer.need("INC")) != ("1", str(increments)):
        raise transfer.refused(f"the first job ends with STEP=1, INC={increments}")
    restated = {k.get("TIE NSET") for k in revolve if k.name == "RIGID BODY"}
    for name in (k.need("TIE NSET") for k in section if k.name == "RIGID BODY"):
        if name not in restated:
            raise transfer.refused(f"drops the *RIGID BODY of {name}: it must be restated")
