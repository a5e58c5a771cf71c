"""A case calibrated: its problem and the fit of it in one call."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.fit.calibrate import Fit
from tyrecal.studies.fit.calibrate import calibrate as calibrate_problem
from tyrecal.studies.fit.prior import PriorProblem
from tyrecal.studies.fit.problem import FitNotify, Problem
from tyrecal.tyre.case import LoadedCase


def calibrate(
    case: LoadedCase,
    evaluator: Evaluator,
    method: str = "slsqp",
    *,
    fixed: Mapping[str, float] | None = None,
    notify: FitNotify | None = None,
    jobs: int = 1,
    prior: bool = False,
    **options: Any,
) -> Fit:
    """The fit of a case's problem, or with ``prior`` of its problem with what is known before."""
    kind = PriorProblem if prior else Problem
    return calibrate_problem(kind(case, evaluator, fixed, notify, jobs), method, **options)
