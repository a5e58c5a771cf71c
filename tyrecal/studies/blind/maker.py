"""Who makes the data: a solver, a mesh, and laws by which effects enter the tyre."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import log

from ...files import Json
from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator, Question
from ...simulate.evaluate.store import Store
from ...simulate.modes.find import LabelledModes, find_modes
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ...tyre.effects import catalogue
from .laws import OUTSIDE_FAMILIES, EffectLaw, Frequencies


@dataclass(frozen=True)
class Computed:
    """A tyre at one pressure, without noise."""

    ln_f: Frequencies
    ln_mass: float  # in kg

    def plain(self) -> Json:
        """As plain data for JSON."""
        ln_f = {str(label): list(pair) for label, pair in self.ln_f.items()}
        return {"ln_mass": self.ln_mass, "ln_f": ln_f}


@dataclass
class Maker:
    """An installed solver that makes data."""

    about: str  # description for the protocol
    solver: str  # its name
    laws: Mapping[str, EffectLaw]  # of effects, by id
    outside: Mapping[str, EffectLaw]  # of families that the catalogue does not hold, by name
    store: Store | None = None  # of finished evaluations; None: they are not kept

    def compute(self, case: LoadedCase, labels: list[Label]) -> Computed:
        """The tyre as ``case`` has it. Raises EvaluationFailed, also where a label is lost, and
        ValueError where no such tyre can be."""
        evaluator = Evaluator(TyreDesign(case), self.solver, store=self.store)
        ((_, labelled),) = find_modes(evaluator, [Question({})], labels)
        if not isinstance(labelled, LabelledModes):
            raise labelled
        ln_f = {}
        for label in labels:
            mode = labelled.wanted[label]
            low, high = mode.raw.members or (mode.frequency_Hz, mode.frequency_Hz)
            ln_f[label] = log(low), log(high)
        return Computed(ln_f, log(labelled.evaluation.mass_kg))


def bundled_maker(case: LoadedCase, store: Store | None = None) -> Maker:
    """The diagnosis' own model, mesh and laws, of the effects that the solver can express."""
    able = frozenset(Evaluator(TyreDesign(case), "bundled").solver.capabilities)
    effects = {id: e for id, e in catalogue().items() if e.within(able)}
    laws = {id: EffectLaw(*e.range_on(case), e.add) for id, e in effects.items()}
    about = "bundled solver, the diagnosis' own mesh and the catalogue's laws: an inverse crime"
    return Maker(about, "bundled", laws, OUTSIDE_FAMILIES, store)
