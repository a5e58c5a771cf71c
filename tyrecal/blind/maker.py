"""Who makes the data: a solver, a mesh, and laws by which effects enter the tyre."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import log
from typing import Protocol

from ..case import LoadedCase
from ..case.calibration import TargetMode, Targets
from ..deck.tyre_design import TyreDesign
from ..evaluate.evaluator import Evaluator
from ..evaluate.failure import EvaluationFailed
from ..evaluate.store import Store
from ..fit.problem import Problem
from ..modes.mode import Label
from .laws import Frequencies, Law, catalogue_laws
from .outside import FAMILIES


@dataclass(frozen=True)
class Computed:
    """A tyre at one pressure, without noise."""

    ln_f: Frequencies
    ln_mass: float  # in kg


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

    def compute(self, case: LoadedCase, labels: list[Label]) -> Computed:
        """The tyre as it stands in ``case``. Raises EvaluationFailed; ValueError."""


@dataclass(frozen=True)
class SolverMaker:
    """An installed solver."""

    about: str
    solver: str
    laws: Mapping[str, Law]
    outside: Mapping[str, Law]
    store: Store | None = None

    def compute(self, case: LoadedCase, labels: list[Label]) -> Computed:
        """Raises EvaluationFailed, also where a label is lost."""
        targets = [
            TargetMode(c=x.c, m=x.m, kind=x.kind, frequency_Hz=1.0)  # type: ignore[arg-type]
            for x in labels
        ]
        wanted = {"targets": Targets(modes=targets), "variables": {}}
        case = replace(case, case=case.case.model_copy(update=wanted))
        evaluator = Evaluator(TyreDesign(case), self.solver, store=self.store)
        (found,) = Problem(case, evaluator).modes([{}])
        if isinstance(found, EvaluationFailed):
            raise found
        evaluation, modes, _ = found
        ln_f = {}
        for label in labels:
            low, high = modes[label].raw.members or (modes[label].frequency_Hz,) * 2
            ln_f[label] = log(low), log(high)
        return Computed(ln_f, log(evaluation.mass_kg))


def bundled_maker(case: LoadedCase, store: Store | None = None) -> SolverMaker:
    """The diagnosis' own model, mesh and laws."""
    laws = catalogue_laws(frozenset(Evaluator(TyreDesign(case), "bundled").solver.capabilities))
    about = "bundled solver, the diagnosis' own mesh and the catalogue's laws: an inverse crime"
    return SolverMaker(about, "bundled", laws, FAMILIES, store)
