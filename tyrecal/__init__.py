"""tyrecal: calibrates tyre finite element models to measured modes.

>>> import tyrecal
>>> case = tyrecal.load_case("cases/p235_75r17.yaml", mesh="coarse")
>>> for mode in tyrecal.evaluate_modes(case)[:3]:
...     print(f"{mode.label}: {mode.frequency_Hz:.1f} Hz")
[0,0] axial: 37.0 Hz
[0,0] torsional: 38.1 Hz
[1,1]: 43.5 Hz

What is offered stands in ``tyrecal.__all__``, and is imported when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .api import (
        CaseError,
        Diagnosis,
        Effect,
        EvaluationFailed,
        Fit,
        LoadedCase,
        Mode,
        State,
        diagnose_case,
        evaluate_footprint,
        evaluate_modes,
        fit_case,
        list_effects,
        load_case,
        read_results,
        sweep_pressure,
        with_values,
    )

__version__ = "0.1.0"

__all__ = [
    "CaseError",
    "Diagnosis",
    "Effect",
    "EvaluationFailed",
    "Fit",
    "LoadedCase",
    "Mode",
    "State",
    "diagnose_case",
    "evaluate_footprint",
    "evaluate_modes",
    "fit_case",
    "list_effects",
    "load_case",
    "read_results",
    "sweep_pressure",
    "with_values",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'tyrecal' has no attribute '{name}'")
    from . import api

    return getattr(api, name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]
