"""A stand-in with patches and stiffnesses that are powers of the variables, and the real modes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.store import Store
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.case.schema import TargetFootprint, TargetMode
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from ..studies.hertz import Hertz

CASE = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
START = start_values(CASE)
AREA = {"A_belt": -0.05, "A_carcass": -0.2, "C10": -0.1}
STIFFNESS = {"A_belt": 0.1, "A_carcass": 0.15, "C10": 0.3}
LENGTH = {"A_belt": 0.0, "A_carcass": -0.12, "C10": -0.2}
WIDTH = {"A_belt": 0.0, "A_carcass": -0.08, "C10": 0.1}
AREA_0, STIFFNESS_0 = np.pi * 0.08 * 0.05, 1.5 * 4000 / 0.02  # of Hertz at 4 kN
LENGTH_0, WIDTH_0 = 0.16, 0.10


def power(values: Mapping[str, float], powers: Mapping[str, float]) -> float:
    """prod_j (x_j / start_j)^p_j."""
    return float(np.prod([(values[n] / START[n]) ** p for n, p in powers.items()]))


class Elastic(Hertz):
    """Areas, lengths, widths and stiffnesses, as powers of the variables."""

    def write(self, decks: Any, folder: Path) -> list[Path]:
        """The real decks; remembers what the formulas need."""
        paths = super().write(decks, folder)
        if decks.loads_N:
            self.size = power(decks.values, AREA) ** 0.5
            self.factor = power(decks.values, STIFFNESS)
            self.long = LENGTH_0 * power(decks.values, LENGTH)
            self.wide = WIDTH_0 * power(decks.values, WIDTH)
        return paths

    def footprint(self, load: float) -> dict[str, Any]:
        """Footprint of one load."""
        footprint = super().footprint(load)
        footprint["stiffness_N_per_m"] *= self.factor
        scale = (load / 4e3) ** (1 / 3)
        return footprint | {
            "contact_length_m": scale * self.long,
            "contact_width_m": scale * self.wide,
        }


class Roadless(Bundled):
    """The bundled solver, were it to know no road."""

    capabilities = Bundled.capabilities - {"footprint"}


def case_with(modes: list[TargetMode], footprint: list[TargetFootprint]) -> LoadedCase:
    """The main case with other targets, pressed at 4 kN at once."""
    targets = CASE.case.targets.model_copy(update={"modes": modes, "footprint": footprint})
    road = CASE.case.road.model_copy(update={"loads_N": [4000.0, 6000.0]})
    return replace(CASE, case=CASE.case.model_copy(update={"targets": targets, "road": road}))


def area_target(value: float, sigma: float, load: float = 4000.0, **more: float) -> TargetFootprint:
    return TargetFootprint(load_N=load, contact_area_m2=value, sigma_m2=sigma, **more)


def stiffness_target(
    value: float, sigma: float, load: float = 4000.0, **more: float
) -> TargetFootprint:
    return TargetFootprint(
        load_N=load, vertical_stiffness_N_per_m=value, sigma_N_per_m=sigma, **more
    )


def evaluator(case: LoadedCase, folder: Path | None = None, **options: float) -> Evaluator:
    """A evaluator to the stand-in, with a record where there is a folder."""
    solver = Elastic()
    for name, value in options.items():
        setattr(solver, name, value)
    return Evaluator(TyreDesign(case), store=Store(folder) if folder else None, _solver=solver)
