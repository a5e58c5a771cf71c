"""Studies of a tyre. A study is a `Result` with a `run`, its figures in `report` and its command in
`cli`. One from outside names its `Result` as an entry point ``tyrecal.studies`` and its command as
one of ``tyrecal.commands``."""

from __future__ import annotations

import logging
from importlib import import_module
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from ..errors import InputError

if TYPE_CHECKING:
    from .result import Result

log = logging.getLogger("tyrecal")

STUDY_GROUP = "tyrecal.studies"
RESULT_TYPES = {  # in the order of a page
    "fit": "tyrecal.studies.fit.result:FitResult",
    "modes": "tyrecal.studies.modes:ModesResult",
    "sweep-pressure": "tyrecal.studies.pressure_result:PressureSweep",
    "footprint": "tyrecal.studies.footprint:FootprintResult",
    "effects": "tyrecal.studies.effects:Effects",
    "sweep-load": "tyrecal.studies.loaded_result:LoadSweep",
    "sample": "tyrecal.studies.sample.result:SampleResult",
    "labels": "tyrecal.studies.labels:LabelsResult",
    "diagnose": "tyrecal.studies.diagnose.result:DiagnosisResult",
}


def result_types() -> dict[str, type[Result]]:
    """Types of results by the name of the study, those from outside last; one that cannot be loaded
    is named and left out."""
    from ..tyre.plugins import load_plugin

    types = {name: named(place) for name, place in RESULT_TYPES.items()}
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
