"""Studies of a tyre. A study is one class, a `Result`, with `run`, its figures in `report` and its
command in `cli`. One from outside names its `Result` as an entry point ``tyrecal.studies`` and its
command as one of ``tyrecal.commands``. Batch and `api.run` know no study by name.

>>> from tyrecal.simulate.deck.tyre_design import TyreDesign
>>> from tyrecal.simulate.evaluate.evaluator import Evaluator
>>> import tyrecal
>>> case = tyrecal.load_case("cases/p235_75r17.yaml", mesh="coarse")
>>> evaluator = Evaluator(TyreDesign(case))
"""

from __future__ import annotations

import logging
from importlib import import_module
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import InputError

if TYPE_CHECKING:
    from .result import Result

log = logging.getLogger("tyrecal")

STUDY_GROUP = "tyrecal.studies"


class Entry(NamedTuple):
    """A built-in study, known without importing it."""

    place: str  # of its class, "module:name"
    help: str = ""  # one line on its command; "": the command of another study runs it
    runs_by_name: bool = False  # in a batch and by `api.run`: it has a `Result.run`


STUDIES = {  # in the order of a page and of a batch
    "fit": Entry(
        "tyrecal.studies.fit.result:FitResult",
        "Calibrate the case's variables to its target frequencies.",
        runs_by_name=True,
    ),
    "modes": Entry(
        "tyrecal.studies.modes:ModesResult",
        "Evaluate one design, unloaded or on a road: frequencies with their labels.",
        runs_by_name=True,
    ),
    "sweep-pressure": Entry(
        "tyrecal.studies.pressure_result:PressureSweep",
        "Follow every mode over the inflation pressure.",
        runs_by_name=True,
    ),
    "sweep": Entry(
        "tyrecal.studies.sweep_result:SweepResult",
        "Sweep numbers of the case over a grid or a Latin hypercube.",
        True,
    ),
    "footprint": Entry(
        "tyrecal.studies.footprint:FootprintResult",
        "Press the tyre on a road: contact area and pressure over load.",
        runs_by_name=True,
    ),
    "sensitivities": Entry(
        "tyrecal.studies.sensitivities.result:SensitivitiesResult",
        "State how each number of the case moves frequencies, and which numbers to free.",
        runs_by_name=True,
    ),
    "frf": Entry(
        "tyrecal.studies.response:FrfResult",
        "Compute response functions of the tread and the hub.",
        runs_by_name=True,
    ),
    "stiffness": Entry(
        "tyrecal.studies.stiffness:StiffnessResult",
        "Find the static stiffnesses of the pressed tyre, over load and pressure.",
        runs_by_name=True,
    ),
    "effects": Entry(
        "tyrecal.studies.effects:Effects", "List and explain effects that a plain model leaves out."
    ),
    "sweep-load": Entry("tyrecal.studies.loaded_result:LoadSweep"),
    "sample": Entry(
        "tyrecal.studies.sample.result:SampleResult",
        "Sample the variables that fit the measurements, and predict frequencies.",
        runs_by_name=True,
    ),
    "labels": Entry("tyrecal.studies.labels:LabelsResult"),
    "sensors": Entry("tyrecal.studies.sensors:SensorsResult"),
    "plan": Entry(
        "tyrecal.studies.plan.result:PlanResult",
        "Plan a test: what to measure, in which order, and what it can find.",
        runs_by_name=True,
    ),
    "diagnose": Entry(
        "tyrecal.studies.diagnose.result:DiagnosisResult",
        "Find where model and measurements differ, and which effect explains it.",
        runs_by_name=True,
    ),
}


def runnable() -> list[str]:
    """Names of the studies that run by name, those from outside last."""
    built_in = [name for name, entry in STUDIES.items() if entry.runs_by_name]
    return [*built_in, *(entry.name for entry in entry_points(group=STUDY_GROUP))]


def study_class(name: str) -> type[Result]:
    """The class of a study. Raises InputError where there is no such study."""
    from ..tyre.case.mistakes import suggestion

    types = result_types()
    if name not in types:
        raise InputError(f"there is no study '{name}'{suggestion(name, types)}")
    return types[name]


def result_types() -> dict[str, type[Result]]:
    """Types of results by the name of the study, those from outside last; one that cannot be loaded
    is left out, with a warning in the log.

    >>> list(result_types())[:3]
    ['fit', 'modes', 'sweep-pressure']
    """
    from ..tyre.plugins import load_plugin

    types = {name: named(entry.place) for name, entry in STUDIES.items()}
    for entry in entry_points(group=STUDY_GROUP):
        try:
            types[entry.name] = load_plugin(entry, "study")
        except InputError as error:
            log.warning("%s", error)
    return types


def named(place: str) -> Any:
    """Import the object that a place ``module:name`` names."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
