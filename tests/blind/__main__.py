"""`tyrecal blind make` by another maker than the diagnosis' own model:

python -m tests.blind calculix DIR --case cases/p235_75r17.yaml --effects 300
python -m tests.blind bundled DIR --case cases/p235_75r17.yaml

These makers are no inverse crime: another mesh, other laws, and another solver.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from functools import partial
from unittest.mock import patch

from tyrecal.cli.main import main
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.maker import OUTSIDE_FAMILIES, Computed, Maker
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.effects.edit import with_part

from .laws import other_laws

FINER = 1.2  # times as many elements along the section as the case's own mesh


class OtherMaker(Maker):
    """A solver on a finer mesh, with other laws than the catalogue's."""

    def compute(self, case: LoadedCase, labels: list[Label]) -> Computed:
        return super().compute(finer(case), labels)


def finer(case: LoadedCase) -> LoadedCase:
    """The case with another mesh, a fifth finer along the section."""
    mesh = case.case.mesh
    level = mesh.levels[mesh.level]
    elements = {name: math.ceil(FINER * n) for name, n in level.elements.items()}
    levels = {**mesh.levels, mesh.level: with_part(level, elements=elements)}
    return replace(case, case=case.case.model_copy(update={"mesh": with_part(mesh, levels=levels)}))


def other_maker(solver: str, case: LoadedCase, store: Store | None = None) -> OtherMaker:
    """``bundled``: for what CalculiX's sector cannot express; ``calculix``: the honest one."""
    laws = other_laws(frozenset(Evaluator(TyreDesign(case), solver).solver.capabilities))
    about = f"{solver} solver on another mesh, effects by other laws than the catalogue's"
    return OtherMaker(about, solver, laws, OUTSIDE_FAMILIES, store)


if __name__ == "__main__":
    solver, *rest = sys.argv[1:]
    with patch("tyrecal.studies.blind.maker.bundled_maker", partial(other_maker, solver)):
        main(["blind", "make", *rest])
