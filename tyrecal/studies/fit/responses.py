"""How a fit answers its data, and the linear model about a design: for `total_error` and
`prediction`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ...tyre.case.parts import RimSupport
from ..inference.model import Answer, Query
from ..inference.observations import Observable
from ..inference.tyre_model import TyreModel
from ..inference.uncertainties import Source
from ..result import ResultPart
from ..variable import read_variable

Array = np.ndarray


class FitResponse(ResultPart):
    """A measured value that counts: a mode at a pressure on a rim, the mass (no c and m), or one
    on the road (load_N)."""

    c: int | None = None
    m: int | None = None
    kind: str | None = None
    pressure_kPa: float = 0.0
    load_N: float = 0.0
    rim: RimSupport | None = None
    scatter: float  # relative standard deviation of the measured value
    # d x / d ln value by variable; x: ln of the variable, or its share of the bounds' width
    response: dict[str, float]

    @property
    def label(self) -> Label | None:
        """[c, m], None of the mass."""
        if self.c is None or self.m is None:
            return None
        return Label(self.c, self.m, self.kind)


def linear_answer(
    case: LoadedCase,
    evaluator: Evaluator,
    values: Mapping[str, float],
    rows: Sequence[Observable],
    known: list[Source],
    jobs: int = 1,
) -> tuple[Array, Array, float]:
    """Sensitivities d ln q / d x (n, v) of rows at the design ``values``, changes of ln q (n, k) by
    one standard deviation of each source of error, and the standard deviation of ln f by each part
    of the error of material laws (`form_error`). Raises DeckRefused, EvaluationFailed."""
    distinct = list(dict.fromkeys(row.row for row in rows))
    model = TyreModel(case, evaluator, distinct, known, {}, jobs)
    own = (read_variable(case, name) for name in model.variables)
    x = np.array([each.scaled(values[each.name]) for each in own])
    (answer,) = model.answers([Query(x, constants=True)])
    if not isinstance(answer, Answer):
        raise answer if isinstance(answer, EvaluationFailed) else ValueError(str(answer))
    assert answer.constants is not None
    places = [distinct.index(row.row) for row in rows]
    return answer.jacobian[places], answer.constants[places], model.material_laws
