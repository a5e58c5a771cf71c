"""Who makes the data: a solver, a mesh, and laws by which effects enter the tyre."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import log

from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator, Question
from ...simulate.evaluate.store import Store
from ...simulate.modes.find import LabelledModes, find_modes
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from .laws import EffectLaw, Frequencies, catalogue_laws
from .outside import OUTSIDE_FAMILIES


@dataclass(frozen=True)
class Computed:
    """A tyre at one pressure, without noise."""

    ln_f: Frequencies
    ln_mass: float  # in kg


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
            low, high = (
                labelled.wanted[label].raw.members or (labelled.wanted[label].frequency_Hz,) * 2
            )
            ln_f[label] = log(low), log(high)
        return Computed(ln_f, log(labelled.evaluation.mass_kg))


def bundled_maker(case: LoadedCase, store: Store | None = None) -> Maker:
    """The diagnosis' own model, mesh and laws."""
    laws = catalogue_laws(
        case, frozenset(Evaluator(TyreDesign(case), "bundled").solver.capabilities)
    )
    about = "bundled solver, the diagnosis' own mesh and the catalogue's laws: an inverse crime"
    return Maker(about, "bundled", laws, OUTSIDE_FAMILIES, store)
