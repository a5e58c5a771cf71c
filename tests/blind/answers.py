"""Answers of our own studies: with intervals for modes that were not measured.

The n measured rows y and the m others y' are normal with covariance T, as in `robustness`, and
means mu and mu', the model at the prior's centre of x. Given y:

    E y' = mu' + T'n T_nn^-1 (y - mu),   var y' = T'' - T'n T_nn^-1 T_n'

(Rasmussen and Williams, Gaussian Processes for Machine Learning, eq. 2.19). So the errors of
constants and of the section that the data show correct the predictions, too. Means and variances
are pooled over q: sizes of effects, couplings zeta, or explanations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.polynomial.legendre import leggauss

from tyrecal.files import Json
from tyrecal.measured.tables import read_measurements
from tyrecal.studies.blind.answer import content_of, labels_at
from tyrecal.studies.blind.protocol import Protocol
from tyrecal.studies.diagnose.diagnosis import Diagnosis, diagnose
from tyrecal.studies.diagnose.evidence import OUTSIDE, Hypothesis
from tyrecal.studies.diagnose.posteriors import likeliest
from tyrecal.studies.diagnose.robustness import LinearFit, line_about
from tyrecal.studies.inference.expansion import Expansion
from tyrecal.studies.inference.inverse_problem import Assumed, InverseProblem
from tyrecal.studies.inference.model import ModelRow, ResponseModel
from tyrecal.studies.inference.observations import Observable, observe
from tyrecal.studies.inference.veering import ZETA_POINTS, rule

Array = np.ndarray
# probability of a size or an explanation over that of the likeliest below which it is left out
NEGLIGIBLE = 1e-3
MIN_ZETA_SHARE = 0.01  # probability of a value of zeta (`veering`) above which it is used
HALF_90 = 1.6449  # half of a 90 % interval of a normal distribution, in standard deviations


def one_answer(
    model: ResponseModel,
    rows: list[ModelRow],
    protocol: Protocol,
    known: Expansion,
    trial: Path,
    further: float = Assumed.further,
) -> Json:
    """As `answer.one_answer`, with intervals. further: see `Assumed`; for rules that tell how many
    effects tyres have."""
    observations = observe(read_measurements(trial), split=protocol.split)
    assumed = Assumed(split=protocol.split, further=further)
    diagnosis = diagnose(model, rows, observations, assumed=assumed, known=known, ranked=False)
    content = {"further": further, **content_of(diagnosis, rows, protocol)}
    content["held_out"]["expected_Hz"] = intervals(diagnosis, rows, protocol.held_out_kPa)
    return content


def intervals(
    diagnosis: Diagnosis, rows: Sequence[ModelRow], pressure_kPa: float
) -> dict[str, list[float]]:
    """Hz by label at a pressure that was not fitted: mean of all explanations of the catalogue,
    weighted by their probabilities, and the ends of its 90 % interval."""
    labels = labels_at(diagnosis, rows, pressure_kPa)
    known = expected(diagnosis.problem, diagnosis.hypotheses, rows, np.array([*labels]))
    three = np.exp([known.mean, *known.interval()]).T.tolist()
    rounded = [[round(f, 4) for f in each] for each in three]
    return dict(zip(labels.values(), rounded, strict=True))


@dataclass(frozen=True)
class Expected:
    """Predicted ln values of the tyre itself, without the scatter of a measurement."""

    mean: Array  # (m,) ln f
    deviation: Array  # (m,) standard deviation of ln f

    def interval(self) -> tuple[Array, Array]:
        """Lower and upper ends of the 90 % intervals, each of the shape of ``mean``."""
        half = HALF_90 * self.deviation
        return self.mean - half, self.mean + half


def expected(
    problem: InverseProblem,
    hypotheses: Sequence[Hypothesis],
    rows: Sequence[ModelRow],
    places: Array,
) -> Expected:
    """Prediction of the rows of the model with the indices ``places`` (m,), pooled over all
    explanations except "outside"."""
    known = [h for h in hypotheses if h.key != OUTSIDE]
    ln = np.array([h.ln_evidence + np.log(h.prior) for h in known])
    p = np.exp(ln - ln.max())
    kept = np.flatnonzero(p > NEGLIGIBLE)
    each = [expected_by(problem, known[k], rows, places) for k in kept]
    return _pooled(
        p[kept], np.array([e.mean for e in each]), np.array([e.deviation**2 for e in each])
    )


def expected_by(
    problem: InverseProblem, hypothesis: Hypothesis, rows: Sequence[ModelRow], places: Array
) -> Expected:
    """`expected` by one explanation. Rows that were not measured join the problem with the values
    of `likeliest`, from which `_conditional` counts their residuals."""
    p = hypothesis.posterior
    on = np.flatnonzero(p > NEGLIGIBLE * p.max())
    d = hypothesis.fitted.d[on]
    measured, count = problem.observations, len(problem.places)
    none = np.full(len(places), np.nan)
    joint = replace(
        problem,
        places=np.append(problem.places, places),
        observations=replace(
            measured,
            rows=(*measured.rows, *(Observable.of(rows[i]) for i in places)),
            y=np.append(measured.y, likeliest(problem, hypothesis, rows, places)),
            scatter=np.append(measured.scatter, np.zeros(len(places))),
            split=np.append(measured.split, none),
            split_scatter=np.append(measured.split_scatter, none),
        ),
    )
    # shift, tilt and uncertainty of eta of all n + m rows
    added = joint.added({id: e[on] for id, e in hypothesis.values.items()}, len(on))
    couplings: list[tuple[int | None, Array]] = [(None, np.ones(len(on)))]
    if joint.veering.active:
        couplings = _coupled(hypothesis.fitted.coupled[on])
    each = [_conditional(line_about(joint, added, d, k), joint, count) for k, _ in couplings]
    weights = np.concatenate([p[on] * share for _, share in couplings])
    mean, variance = (np.concatenate(part) for part in zip(*each, strict=True))
    return _pooled(weights, mean, variance)


def _coupled(coupled: Array) -> list[tuple[int | None, Array]]:
    """Indices of zeta in `veering.rule` with the probability (q,) of each. coupled (q, k): density
    at its k points (`Fitted.coupled`); without points, if no near modes were measured, the prior's
    N(0, 1)."""
    zeta, weights = rule()[0], leggauss(ZETA_POINTS)[1]
    if not coupled.shape[1]:
        coupled = np.tile(np.exp(-(zeta**2) / 2), (len(coupled), 1))
    share = coupled * weights
    share = share / share.sum(1, keepdims=True)
    return [(k, share[:, k]) for k in range(len(zeta)) if share[:, k].max() > MIN_ZETA_SHARE]


def _conditional(line: LinearFit, problem: InverseProblem, count: int) -> tuple[Array, Array]:
    """Mean and variance (q, m) of the rows after the first ``count``, which are measured."""
    J = line.slopes * problem.spread  # by x in standard deviations of its prior
    T = line.covariance(problem) + J @ J.transpose(0, 2, 1)
    known, cross = T[:, :count, :count], T[:, :count, count:]
    gain = np.linalg.solve(known, cross).transpose(0, 2, 1)
    r = line.residual[:, :, None]
    mean = problem.observations.y[count:] - (r[:, count:] - gain @ r[:, :count])[:, :, 0]
    taken = np.einsum("qmn,qnm->qm", gain, cross)
    return mean, np.diagonal(T, axis1=1, axis2=2)[:, count:] - taken


def _pooled(p: Array, mean: Array, variance: Array) -> Expected:
    """Pool means and variances (q, m) that have the probabilities p (q,)."""
    p = p / p.sum()
    middle = p @ mean
    spread = p @ (np.maximum(variance, 0.0) + (mean - middle) ** 2)
    return Expected(middle, np.sqrt(spread))
