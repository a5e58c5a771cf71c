"""Who makes the data of blind trials: a solver, a mesh, and laws by which effects, and errors that
no catalogue holds, enter the tyre."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import log, log1p

import numpy as np

from ...files import Json
from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator, Question
from ...simulate.evaluate.store import Store
from ...simulate.modes.find import LabelledModes, find_modes
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ...tyre.case.schema import Cord
from ...tyre.effects import catalogue
from ...tyre.effects.edit import changed, with_gauge, with_layers, with_part
from ...tyre.effects.parts import belt_lines, carcass, carcass_line, crown

Frequencies = Mapping[Label, tuple[float, float]]
"""ln f of both members by label, equal where they do not split."""


@dataclass(frozen=True)
class EffectLaw:
    """How an effect, or what no catalogue holds, enters the tyre by one parameter."""

    low: float  # of the parameter's range, in its unit; 0: the range is on one side
    high: float
    add: Callable[[LoadedCase, float], LoadedCase]  # pure; ValueError where the tyre cannot be
    # what a laboratory reads, by pressure, of what is there and the parameter; None: just that
    read: Callable[[Mapping[float, Frequencies], float], Mapping[float, Frequencies]] | None = None

    def drawn(self, random: np.random.Generator, smallest: float) -> float:
        """A parameter, uniform over ``smallest`` to 1 of the range on a side drawn by chance."""
        ends = [end for end in (self.low, self.high) if end]
        return float(random.choice(ends) * random.uniform(smallest, 1.0))


def thick_cushion(case: LoadedCase, e: float) -> LoadedCase:
    """Rubber between carcass and inner belt is 1 + e times as thick."""
    return with_gauge(case, (carcass_line(case), belt_lines(case)[0]), crown(case), 1 + e)


def bias_carcass(case: LoadedCase, e: float) -> LoadedCase:
    """Carcass cords are ``e`` degrees off the meridian."""
    layers = case.case.rebar_layers
    turned = {x: with_part(layers[x], angle_deg=layers[x].angle_deg + e) for x in carcass(case)}
    return with_layers(case, turned)


def tension_stiffening(case: LoadedCase, e: float) -> LoadedCase:
    """Carcass cords whose modulus goes with their tension: times 1 + e per 100 kPa over the
    pressure of the case file."""
    nominal = case.file_data["pressure_kPa"]
    factor = 1 + e * (case.case.pressure_kPa - nominal) / 100.0
    names = {case.case.rebar_layers[name].material for name in carcass(case)}
    materials = {
        name: with_part(m, youngs_modulus_Pa=factor * m.youngs_modulus_Pa)
        if isinstance(m, Cord) and name in names
        else m
        for name, m in case.case.materials.items()
    }
    return changed(case, materials=materials)


def untouched(case: LoadedCase, e: float) -> LoadedCase:
    """The tyre as it is: the error is the laboratory's."""
    return case


def stand_resonance(computed: Mapping[float, Frequencies], e: float) -> Mapping[float, Frequencies]:
    """A resonance of the test stand, 1 + e times as high as [1,0] at the middle pressure and the
    same at all, is taken for [1,0]."""
    vertical = Label(1, 0)
    middle = sorted(computed)[len(computed) // 2]
    stand = sum(computed[middle][vertical]) / 2 + log1p(e)
    return {p: {**ln_f, vertical: (stand, stand)} for p, ln_f in computed.items()}


OUTSIDE_FAMILIES = {  # the ranges are chosen
    "thick_cushion": EffectLaw(0.0, 3.0, thick_cushion),
    "bias_carcass": EffectLaw(0.0, 20.0, bias_carcass),  # degrees
    "tension_stiffening": EffectLaw(-1.0, 1.0, tension_stiffening),
    "stand_resonance": EffectLaw(-0.15, 0.15, untouched, stand_resonance),
}


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
