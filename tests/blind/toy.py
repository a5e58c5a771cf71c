"""A toy tyre as maker and as model: trials in milliseconds, with the real case's labels."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.maker import Computed, EffectLaw, Maker
from tyrecal.studies.blind.protocol import Protocol
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.tyre.case import LoadedCase, number_at, start_values
from tyrecal.tyre.effects.edit import changed

from ..diagnose.toy import Toy
from ..effects.support import coarse

CASE = coarse()
PRESSURES = (160.0, 240.0, 320.0, 200.0)
NUMBERS = ("rebar_layers.belt_1.area_m2", "rebar_layers.carcass.area_m2", "materials.rubber.C10_Pa")
KG = 12.0


class Scale(Toy):
    """The toy with its mass as the first row, which depends on the first variable alone."""

    def __init__(self, effects: int = 4, size: float = 0.02) -> None:
        super().__init__(effects, PRESSURES, size, bend=0.005)
        self.constants = 0.3 * self.constants
        self.variables = tuple(CASE.case.variables)
        self.start = np.array([log(v) for v in start_values(CASE).values()])
        self.model_rows = [(None, 0.0), *self.rows]

    def _answer(self, point: Query) -> Answer:
        answer = super()._answer(Query(point.x - self.start, point.effects, point.constants))
        top = lambda row, rest: np.concatenate([np.atleast_2d(row), np.atleast_2d(rest)])
        constants = None
        if answer.constants is not None:
            constants = top(np.zeros((1, 2)), answer.constants)
        return Answer(
            np.append(log(KG) + 0.1 * (point.x[0] - self.start[0]), answer.eta),
            top(np.array([0.1, 0.0, 0.0]), answer.jacobian),
            np.append(0.0, answer.split),
            constants,
        )


class ToyMaker(Maker):
    """Laws write their id and size into the case's name; families stretch one mode."""

    def __init__(self, scale: Scale) -> None:
        laws = {id: EffectLaw(0.0, 1.0, _named(id)) for id in scale.g}
        outside = {"odd_mode": EffectLaw(0.0, 1.0, _named("odd_mode"))}
        super().__init__("a toy", "", laws, outside)
        self.scale = scale

    def compute(self, case: LoadedCase, labels: list[Label]) -> Computed:
        x = np.array([log(number_at(case, path)) for path in NUMBERS])
        id, _, e = case.case.name.partition(" ")
        effects = {id: float(e)} if id in self.scale.g else {}
        (answer,) = self.scale.answers([Query(x, effects)])
        assert isinstance(answer, Answer)
        pressure = min(PRESSURES, key=lambda p: abs(p - case.case.pressure_kPa))
        odd = 0.2 * float(e) if id == "odd_mode" else 0.0
        ln_f = {}
        for label in labels:
            f = answer.eta[self.scale.model_rows.index((label, pressure))]
            f += odd if label == Label(2, 1) else 0.0
            ln_f[label] = f, f
        return Computed(ln_f, float(answer.eta[0]))


def _named(id: str):  # type: ignore[no-untyped-def]
    return lambda case, e: changed(case, name=f"{id} {e!r}")


def protocol(effect: int = 0, none: int = 0, outside: int = 0, **rules: float) -> Protocol:
    """Rules with so many trials."""
    counts = {"effect": effect, "none": none, "outside": outside}
    return replace(Protocol("a toy", CASE.path.name, counts), **rules)  # type: ignore[arg-type]
