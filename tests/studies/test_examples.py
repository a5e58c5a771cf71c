"""Examples in the docstrings of `tyrecal.studies` run and give what they show.

Those of `diagnose`, `sample` and `blind` are elsewhere.
"""

from __future__ import annotations

import doctest
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest

import tyrecal
from tyrecal import studies
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator

from ..conftest import ROOT

ENTRIES = {  # what other rooms, studies from outside and Python users begin with, by module
    "emulator": ["Emulator"],
    "fit.calibrate": ["calibrate"],
    "fit.problem": ["Problem", "objective"],
    "fit.study": ["FitStudy"],
    "fit.targets": ["Target", "read_targets"],
    "variable": ["DesignVariable", "read_variables"],
    "labelling.tree": ["labelings"],
    "modes": ["run"],
    "run_plan": ["RunPlan"],
    "pressure": ["sweep"],
    "pressure_range": ["PressureRange"],
    "result": ["Column", "Table"],
    "signature": ["Plain"],
}
SLOW = {"Emulator", "calibrate"}


@pytest.fixture(scope="module")
def setting() -> Iterator[dict[str, object]]:
    """Names that the examples take from that of the package."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        case = tyrecal.load_case(Path("cases/p235_75r17.yaml"), mesh="coarse")
        yield {"case": case, "evaluator": Evaluator(TyreDesign(case)), "tyrecal": tyrecal}


@pytest.mark.parametrize(
    ("module", "name"),
    [
        pytest.param(module, name, marks=[pytest.mark.slow] * (name in SLOW))
        for module, names in {"": ["", "result_types"], **ENTRIES}.items()
        for name in names
    ],
)
def test_the_example_of(module: str, name: str, setting: dict[str, object]) -> None:
    room = importlib.import_module(f"{studies.__name__}.{module}".rstrip("."))
    subject = getattr(room, name) if name else room
    finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner()
    (test,) = finder.find(subject, name or module, module=False, globs={**vars(room), **setting})
    assert test.examples
    assert runner.run(test).failed == 0
