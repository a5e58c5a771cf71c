"""The calibration problem with what is known before any measurement, for `fit --prior`.

    F^2 = d^T Sigma^-1 d + sum_i ((x_i - x_0i) / s_i)^2,   d = ln (q / q_ref)

Sigma: covariance of ln q by scatter, material laws, section and uncalibrated constants
(`model_errors`); x_0, s: start of a variable and its standard deviation (`DesignVariable.spread`).
Where Sigma is that of one design, the minimum is the likeliest one of a normal posterior with the
covariance

    C = (J^T Sigma^-1 J + diag(s)^-2)^-1,   J = d ln q / d x

(Tarantola, Inverse Problem Theory, sec. 3.2). A doublet is one measured value here; a weight w
divides a value's variance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...simulate.evaluate.evaluator import Evaluator
from ...tyre.case import LoadedCase
from .model_errors import ModelErrors, model_errors
from .problem import FitNotify, Point, Problem
from .targets import KNOWLEDGE

Array = np.ndarray
SAME_WEIGHTS = 0.1  # of x, within which one design's weights hold for another


@dataclass(frozen=True)
class PriorPoint(Point):
    """A design with the residuals of F above and their Jacobian; measured: with its own."""

    measured: Point

    @property
    def plain(self) -> Point:
        return self.measured


class PriorProblem(Problem):
    """`Problem` with the residuals of F above.

    noise_Hz: standard deviation of frequencies that state none. Sigma is that of the design at
    which `weigh` was last called, at first the start. Raises what `model_errors` does.
    """

    def __init__(
        self,
        case: LoadedCase,
        evaluator: Evaluator,
        fixed: Mapping[str, float] | None = None,
        notify: FitNotify | None = None,
        jobs: int = 1,
    ):
        super().__init__(case, evaluator, fixed, notify, jobs)
        knowledge = np.array([each.quantity == KNOWLEDGE for each in self.measured])
        self.scale = np.where(knowledge, 0.0, self.scale)  # it is in the spread
        counted = self.counted
        self.reference = np.array([each.value for each in counted])
        self.mean = self.start()
        self.spread: Array = np.array([v.spread for v in self.variables])
        self.weighed_at: Array | None = None
        self.model: ModelErrors | None = None  # at that design
        self.covariance = self.root = np.empty((0, 0))  # Sigma (n, n), and L^-1 with L L^T = Sigma

    @property
    def scatter(self) -> Array:
        """Relative standard deviations (n,) of the targets that count, over sqrt(w)."""
        counted = self.counted
        sigma = np.array([each.sigma or self.noise_Hz or np.nan for each in counted])
        return np.asarray(sigma / self.reference / np.sqrt([each.weight for each in counted]))

    def weigh(self, point: Point) -> None:
        """Take Sigma of the design ``point``."""
        self.model = model_errors(self, point)
        self.covariance = self.model.covariance(self.scatter)
        self.root = np.linalg.inv(np.linalg.cholesky(self.covariance))
        self.weighed_at = point.x

    def evaluate(self, x: Array) -> PriorPoint:
        plain = super().evaluate(x)
        if self.weighed_at is None:
            self.weigh(plain)
        q, slopes = self._counted(plain)
        residuals = [self.root @ np.log(q / self.reference), (plain.x - self.mean) / self.spread]
        jacobian = np.vstack([self.root @ slopes, np.diag(1 / self.spread)])
        own = {name: getattr(plain, name) for name in plain.__dataclass_fields__}
        own |= {"residuals": np.concatenate(residuals), "jacobian": jacobian}
        return PriorPoint(**own, measured=plain)

    def is_settled(self, point: Point) -> bool:
        at = self.weighed_at
        return at is not None and abs(point.x - at).max() < SAME_WEIGHTS

    def response(self, point: Point) -> tuple[Array, Array]:
        C, seen = self.covariance_by(point, self.scatter, self.scale > 0)
        weighted = np.linalg.solve(self.covariance, self._counted(point.plain)[1])
        return C @ weighted.T / self.reference, seen

    def left_of_prior(self, point: Point) -> Array:
        """(I - B J) diag(s)^2 (I - B J)^T (v, v), B = C J^T Sigma^-1."""
        seen = self.response(point)[0] * self.reference @ self._counted(point.plain)[1]
        unseen = (np.eye(len(seen)) - seen) * self.spread
        return np.asarray(unseen @ unseen.T)

    def covariance_by(self, point: Point, sigma: Array, used: Array) -> tuple[Array, Array]:
        """C (v, v) of the targets ``used`` alone, with all that is uncertain, and which variables
        (v,) they determine: all, by the prior."""
        keep = used[self.scale > 0]
        J = self._counted(point.plain)[1][keep]
        information = J.T @ np.linalg.solve(self.covariance[np.ix_(keep, keep)], J)
        return np.linalg.inv(information + np.diag(self.spread**-2)), np.ones(len(self.mean), bool)

    def _counted(self, plain: Point) -> tuple[Array, Array]:
        """q (n,) of the targets that count, and J (n, v)."""
        counts = self.scale > 0
        q = self.reference + plain.residuals[counts] / self.scale[counts]
        return q, plain.jacobian[counts] / self.scale[counts, None] / q[:, None]
