"""Evidence of known fits under another covariance, another prior of x or with rows left out.

About a fit eta is linear in x, whose prior is normal with spread S_x: integrated over x

    ln Z = -r^T T^-1 r / 2 - ln|2 pi T| / 2 + ln p(labels) + ln p(splits),   T = S + J S_x J^T,

S (n, n): covariance of the n observations y = ln f; J (n, v) = d eta / dx at the fit; r: residual
of y at the centre of the prior by this linear model (Bishop, Pattern Recognition and Machine
Learning, 2.115). Where the fit is the best one this is Laplace's approximation itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..inference.inverse_problem import Added, InverseProblem
from ..inference.veering import rule
from .evidence import COUPLED_STEPS, model_of, over_zeta, refit_at

Array = np.ndarray


@dataclass(frozen=True)
class Perturbation:
    """The problem with one changed assumption, which ``words`` names."""

    words: str
    problem: InverseProblem  # with the same rows
    keep: Array  # (n,) mask of the rows that are used
    response_factor: float = 1.0  # factor on `Effect.response_error` of all effects

    @property
    def parts_near_modes(self) -> bool:
        """Whether a row is left out that is coupled with another mode (`veering`). The evidence of
        the labels and the partner's frequency then change, so linear fits do not hold."""
        return bool(self.problem.veering.size[~self.keep].any())


@dataclass(frozen=True)
class LinearFit:
    """A hypothesis at parameters (q,), linear in x about its re-fits, at one zeta of `veering`."""

    place: int | None  # index of zeta in `veering.rule`; None: no modes are coupled
    residual: Array  # (q, n) at the centre of x
    slopes: Array  # (q, n, v) J = d eta / dx
    by_response: Array  # (q, n, n) covariance of the effects' shifts by `Effect.response_error`
    by_shape: Array  # (q, n, n) and by `Effect.shape_uncertainty`
    ln_label: Array  # (q,) ln probability of the labels
    split: Array  # (q, n) distance of the two modes of a pair, in ln f
    ln_damping: Array | float = 0.0  # (q,) ln probability of the damping ratios

    def covariance(self, problem: InverseProblem, response_factor: float = 1.0) -> Array:
        """S (q, n, n): covariance of the observations under the hypothesis."""
        at = problem if self.place is None else problem.integrand[self.place]
        return np.asarray(at.sigma + response_factor**2 * self.by_response + self.by_shape)

    def ln_evidence(self, other: Perturbation, extra: Array | None) -> tuple[Array, Array]:
        """ln Z and chi2 of the data (q,). extra (q, n, n): more covariance."""
        problem, keep = other.problem, other.keep
        S = self.covariance(problem, other.response_factor)
        S = (S if extra is None else S + extra)[:, keep][:, :, keep]
        r, J = self.residual[:, keep], self.slopes[:, keep] * problem.spread
        T = S + J @ J.transpose(0, 2, 1)
        w = np.linalg.solve(T, r[:, :, None])
        whole, taken = (w[:, :, 0] * r).sum(1), (J.transpose(0, 2, 1) @ w)[:, :, 0]
        ln = -(whole + np.linalg.slogdet(T)[1] + keep.sum() * np.log(2 * np.pi)) / 2
        ln += self.ln_label + problem.only(keep).splits.ln_likelihood(self.split[:, keep])
        if problem.damping:
            ln += self.ln_damping
        return ln, whole - (taken**2).sum(1)  # taken: x of the likeliest fit, over its spread


def lines(
    problem: InverseProblem,
    effects: Mapping[str, Array],
    near: Array,
    among: Mapping[int, float] | None = None,
    extra: Array | None = None,
) -> list[LinearFit]:
    """One for each point of the rule in what couples near modes, or one if none are, about re-fits
    that start from x - x0 = near (q, v); the rest as in `refit`."""
    added, result = problem.added(effects, len(near)), []
    places: list[int | None] = [*(among or range(len(problem.integrand)))]
    for k in places or [None]:
        at = problem if k is None else problem.integrand[k]
        fitted = refit_at(problem, at, added, extra, near, COUPLED_STEPS)
        line = line_about(problem, added, fitted.d, k)
        if problem.damping:
            information = np.linalg.inv(fitted.covariance)
            ln = problem.damping.ln_likelihood(added.damping, fitted.d, information)
            line = replace(line, ln_damping=ln)
        result.append(line)
    return result


def line_about(problem: InverseProblem, added: Added, d: Array, place: int | None) -> LinearFit:
    """About x - x0 = d (q, v), with what effects add."""
    at = problem if place is None else problem.integrand[place]
    eta, J, ln_label = model_of(problem, at, added)(d)
    back = d - (problem.centre - problem.expansion.x0)
    residual = problem.observations.y - eta + (J @ back[:, :, None])[:, :, 0]
    # with their standard deviations transformed to the coupled modes
    by_response, by_shape = problem.response_covariances(at.with_mixed_laws(added))
    return LinearFit(place, residual, J, by_response, by_shape, ln_label, added.split)


def perturbed_evidence(
    known: list[LinearFit],
    other: Perturbation,
    among: Mapping[int, float] | None = None,
    extra: Array | None = None,
) -> tuple[Array, Array]:
    """ln Z, and chi2 of the likeliest way in which near modes are coupled, (q,). among: as of
    `several.coupled_most`."""
    ln, chi2 = map(np.array, zip(*(line.ln_evidence(other, extra) for line in known), strict=True))
    if known[0].place is None:
        return ln[0], chi2[0]
    zeta = np.array([rule()[0][line.place] for line in known if line.place is not None])
    best = (ln - zeta[:, None] ** 2 / 2).argmax(0)
    return over_zeta(ln, among), chi2[best, np.arange(len(best))]
