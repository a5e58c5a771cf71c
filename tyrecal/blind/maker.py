"""Who makes the data: a solver, a mesh, and laws by which effects enter the tyre."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

from ..case import LoadedCase
from ..case.calibration import TargetMode, Targets
from ..effects.edit import with_part
from ..evaluate.door import Door
from ..evaluate.failure import EvaluationFailed
from ..evaluate.store import Store
from ..fit.problem import Problem
from ..modes.mode import Label
from .laws import Law, catalogue_laws, other_laws
from .outside import FAMILIES

FINER = 1.2  # times as many elements along the section as the case's own mesh
NAMES = ("bundled", "bundled-other", "calculix")


@dataclass(frozen=True)
class Heard:
    """A tyre at one pressure: ln f of both members by label (equal where they do not split), and
    ln of the tyre's mass in kg."""

    ln_f: Mapping[Label, tuple[float, float]]
    ln_mass: float


class Maker(Protocol):
    """Makes data."""

    @property
    def about(self) -> str:
        """In words, for the protocol."""

    @property
    def laws(self) -> Mapping[str, Law]:
        """Of effects, by id."""

    @property
    def outside(self) -> Mapping[str, Law]:
        """Of families that the catalogue does not hold, by name."""

    def listen(self, case: LoadedCase, labels: list[Label]) -> Heard:
        """The tyre as it stands in ``case``. Raises EvaluationFailed; ValueError."""


@dataclass(frozen=True)
class SolverMaker:
    """A solver behind the door."""

    about: str
    solver: str
    laws: Mapping[str, Law]
    outside: Mapping[str, Law]
    other_mesh: bool
    store: Store | None = None

    def listen(self, case: LoadedCase, labels: list[Label]) -> Heard:
        """Raises EvaluationFailed, also where a label is lost."""
        if self.other_mesh:
            case = finer(case)
        targets = [
            TargetMode(c=x.c, m=x.m, kind=x.kind, frequency_Hz=1.0)  # type: ignore[arg-type]
            for x in labels
        ]
        wanted = {"targets": Targets(modes=targets), "variables": {}}
        case = replace(case, case=case.case.model_copy(update=wanted))
        door = Door(case, self.solver, store=self.store)
        (found,) = Problem(case, door).modes([{}])
        if isinstance(found, EvaluationFailed):
            raise found
        evaluation, modes, _ = found
        ln_f = {}
        for label in labels:
            low, high = modes[label].raw.members or (modes[label].frequency_Hz,) * 2
            ln_f[label] = math.log(low), math.log(high)
        return Heard(ln_f, math.log(evaluation.mass_kg))


def finer(case: LoadedCase) -> LoadedCase:
    """The case with another mesh, a fifth finer along the section."""
    mesh = case.case.mesh
    level = mesh.levels[mesh.level]
    elements = {name: math.ceil(FINER * n) for name, n in level.elements.items()}
    levels = {**mesh.levels, mesh.level: with_part(level, elements=elements)}
    return replace(case, case=case.case.model_copy(update={"mesh": with_part(mesh, levels=levels)}))


def find_maker(name: str, case: LoadedCase, store: Store | None = None) -> SolverMaker:
    """``bundled``: the model of the diagnosis itself, an inverse crime; ``bundled-other``: the same
    solver with another mesh and other laws; ``calculix``: another solver, too."""
    solver = "calculix" if name == "calculix" else "bundled"
    capabilities = frozenset(Door(case, solver).solver.capabilities)
    if name == "bundled":
        about = "bundled solver, the diagnosis' own mesh and the catalogue's laws: an inverse crime"
        return SolverMaker(about, solver, catalogue_laws(capabilities), FAMILIES, False, store)
    about = f"{solver} solver on another mesh, effects by other laws than the catalogue's"
    return SolverMaker(about, solver, other_laws(capabilities), FAMILIES, True, store)
