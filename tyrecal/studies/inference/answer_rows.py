"""Rows of a `ResponseModel` from labelled modes: ln f and ln mass with their sensitivities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from ...simulate.evaluate.failure import DeckRefused
from ...simulate.modes.find import LabelledModes
from ...simulate.modes.label import Label
from ...tyre.number_units import EFFECT_PATH
from ...tyre.state import TyreState
from .model import Answer, ModelRow, Query, state_of
from .model_designs import ModelDesigns
from .uncertainties import Source

Array = np.ndarray
Modes = Mapping[TyreState, tuple[Mapping[str, float], LabelledModes]]  # design and modes by state


@dataclass(frozen=True)
class AnswerRows:
    """Rows (n) whose values are wanted, in the coordinates of ``designs``."""

    rows: Sequence[ModelRow]
    designs: ModelDesigns
    sources: Sequence[Source]
    solver: str  # its name, for refusals

    def answer(self, point: Query, at: Modes) -> Answer:
        """Answer of a query; rows in other states than those of ``at`` are 0. Raises DeckRefused
        where the solver does not give sensitivities of a mass that was measured."""
        rows, names = self.rows, self.designs.names
        eta, jacobian = np.zeros(len(rows)), np.zeros((len(rows), len(names)))
        slopes, split = np.zeros((len(rows), len(self.sources))), np.zeros(len(rows))
        by_pressure, damping = np.zeros(len(rows)), np.full(len(rows), np.nan)
        by_effect = {id: np.full(len(rows), np.nan) for id in point.slopes}  # not the mass
        for i, (label, where) in enumerate(rows):
            if label and state_of(where) not in at:
                continue  # between the ends
            if label is None:
                modes = [labelled for _, labelled in at.values()]
                eta[i] = log(modes[0].evaluation.mass_kg)
                jacobian[i], slopes[i] = self._mass_slopes(point.x, modes)
                continue
            design, labelled = at[state_of(where)]
            gradients, mode = labelled.evaluation.gradients, labelled.wanted[label]
            f, place = mode.frequency_Hz, mode.position
            eta[i] = ln_frequency(label, labelled)
            if members := mode.raw.members:
                split[i] = log(members[1] / members[0])
            if ratio := mode.raw.damping_ratio:
                damping[i] = log(ratio)
            for id, slope in by_effect.items():
                path = EFFECT_PATH + id  # a state may hold it at 0
                slope[i] = gradients[path][place] / f if path in gradients else 0.0
            if "pressure_kPa" in gradients:
                by_pressure[i] = gradients["pressure_kPa"][place] * design["pressure_kPa"] / f
            for j, name in enumerate(names):
                if name in gradients:
                    jacobian[i, j] = gradients[name][place] * self.designs.slope(name, design) / f
            if point.constants:
                for k, source in enumerate(self.sources):
                    slopes[i, k] = sum(
                        step * gradients[path][place] / f
                        for path, step in _steps(source).items()
                        if path in gradients
                    )
        return Answer(
            eta,
            jacobian,
            split,
            slopes if point.constants else None,
            by_effect,
            by_pressure=by_pressure,
            damping=None if np.isnan(damping).all() else damping,
        )

    def _mass_slopes(self, x: Array, modes: Sequence[LabelledModes]) -> tuple[Array, Array]:
        """d ln mass by x (v,) and by the sources of error (k,). Raises DeckRefused where the solver
        does not give them."""
        mass_kg, values = modes[0].evaluation.mass_kg, self.designs.values(x)
        rates = dict[str, float]()
        for each in modes:  # a number that one state sets moves the mass in the others
            rates |= each.evaluation.mass_gradients
            if each.evaluation.gradients.keys() != each.evaluation.mass_gradients.keys():
                raise DeckRefused(
                    f"solver '{self.solver}' gives no sensitivities of the mass, which was measured"
                )
        by_x = [
            rates.get(name, 0.0) * self.designs.slope(name, values) for name in self.designs.names
        ]
        by_source = [
            sum(step * rates.get(path, 0.0) for path, step in _steps(source).items())
            for source in self.sources
        ]
        return np.array(by_x) / mass_kg, np.array(by_source) / mass_kg


def ln_frequency(label: Label, labelled: LabelledModes) -> float:
    """ln f of a mode, of a pair the mean."""
    mode = labelled.wanted[label]
    members = mode.raw.members
    return log(members[0] * members[1]) / 2 if members else log(mode.frequency_Hz)


def _steps(source: Source) -> Mapping[str, float]:
    """Steps of numbers by path, or of the field of the section that the source is."""
    return {source.name: 1.0} if source.field else source.steps
