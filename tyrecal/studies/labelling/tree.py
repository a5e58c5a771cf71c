"""Which mode is each unlabelled frequency? The probability of every labeling.

A labeling a gives each measured frequency f_i one of the tyre's modes j = a(i), none of them twice,
or calls it foreign: of the stand, the rim, the hum of the mains. About an expansion point the model
says, of ln f of its modes,

    y_i = mu_j + H_j z + e_i,    z ~ N(0, I),    e_i ~ N(0, s_i^2)

z: the design variables by their prior standard deviations, and each mode's discrepancy from the
model. So the frequencies of a labeling are jointly normal, and integrating over z is exact: one
frequency after the other, each conditions z for the next (Kalman, J. Basic Engineering 82 (1960)
35). Prior of a labeling:

    a mode within the band is measured with probability 1 - MISSED; the band ends at the highest
    measured frequency, above which a mode costs nothing
    only the modes of one family are, where the shaker or the sensors see one direction (VIEWS)
    foreign ones are FOREIGN on average (Poisson), anywhere in the band: FOREIGN / width each

Where shapes were measured, too, that of a frequency is one more factor: p(shape | mode) over
p(shape | foreign), `measured.case_modes`. Then both modes of a pair may be measured: the
second with the probability SECOND if the first is, and SPLIT from it.

The tree of labelings grows a frequency at a time, lowest first, as in tracking of multiple
hypotheses (Reid, IEEE Trans. Automatic Control 24 (1979) 843); branches a factor of exp(-CUT) below
the best, or beyond the first BRANCHES, are cut. How far the model may be off is not known: the
labelings' evidences are means over `DISCREPANCIES`. All numbers of the priors are assumed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...simulate.modes.label import FAMILIES, Label
from ..inference.covariance import form_error

Array = np.ndarray

MISSED = 0.2  # probability of a mode within the band
FOREIGN = 0.5  # frequencies that are no mode, expected
FOREIGN_MARGIN = 0.1  # of ln f, by which the band of foreign ones is wider than what was measured
# whether in-plane and out-of-plane modes are seen: probability
VIEWS = {(True, True): 0.6, (True, False): 0.2, (False, True): 0.2}
UNSEEN = 0.02  # probability of being measured, of a mode of the other family
DISCREPANCIES = (0.0, 0.01, 0.03, 0.1)  # standard deviations of ln f, each as likely
SECOND, SPLIT = 0.3, 0.01  # SPLIT: standard deviation, of ln f
ALIKE = 4.0  # waves over which the discrepancy of a family's modes falls by e
BRANCHES, CUT = 800, 20.0
FOREIGN_MODE = -1  # what was measured is no mode of the tyre


@dataclass(frozen=True)
class Modes:
    """The tyre's n modes that may have been measured."""

    labels: tuple[Label, ...]
    states: Array  # (n,) number of the state of each mode
    mu: Array  # (n,) ln f at the centre of the prior
    H: Array  # (n, v) d ln f by the variables, each in standard deviations of its prior


@dataclass(frozen=True)
class Frequencies:
    """Measured frequencies by rising value."""

    y: Array  # (m,) ln f
    s: Array  # (m,) standard deviation of y
    states: Array  # (m,) a number each
    allowed: Array  # (m, n) modes that each can be
    sure: Array  # (m,) whether it is known not to be foreign
    # (m, n) ln of p(shape | mode) over p(shape | foreign) of each; None: no shapes were measured
    ln_shape: Array | None = None


@dataclass(frozen=True)
class Labelings:
    """Labelings of the frequencies, the most probable first."""

    modes: Array  # (k, m), -1 of what is foreign
    probabilities: Array  # (k,) of the labelings
    each: Array  # (m, n + 1) probability of every mode of a frequency, the last of foreign
    # (k,) the part of a labeling's weight that is not the evidence of its labelled frequencies,
    # except for a constant
    ln_prior: Array
    z: Array  # (v,) the variables' mean under the first
    discrepancy: float  # the model's, of ln f, its mean over all

    def with_probabilities(self, shares: Array) -> Labelings:
        """The first ones sharing otherwise, ``shares`` (first,), what they have together."""
        first = len(shares)
        p = np.append(self.probabilities[:first].sum() * shares, self.probabilities[first:])
        order = np.argsort(-p, kind="stable")
        modes, p = self.modes[order], p[order]
        return replace(
            self,
            modes=modes,
            probabilities=p,
            each=_of_each(modes, p, self.each.shape),
            ln_prior=self.ln_prior[order],
        )


def labelings(measured: Frequencies, modes: Modes) -> Labelings:
    """All labelings that are not cut.

    >>> import numpy as np
    >>> from tyrecal.simulate.modes.label import Label
    >>> labels, hertz = (Label(2, 0), Label(3, 0)), np.array([80.0, 100.0])
    >>> tyre = Modes(labels, np.zeros(2, int), np.log(hertz), np.full((2, 1), 0.02))
    >>> every, sure, state = np.ones((1, 2), bool), np.ones(1, bool), np.zeros(1, int)
    >>> measured = Frequencies(np.log([80.5]), np.array([0.005]), state, every, sure)
    >>> best = labelings(measured, tyre)
    >>> print(labels[best.modes[0, 0]], round(best.probabilities[0], 3))
    [2,0] 0.998
    """
    total: dict[tuple[int, ...], float] = {}
    evidence: dict[tuple[int, ...], float] = {}
    means: dict[tuple[int, ...], tuple[float, Array]] = {}
    strata = []  # ln of the evidence of each discrepancy
    for tau in DISCREPANCIES:
        chosen, ln, of_labelled, mean = _tree(measured, modes, tau)
        strata.append(np.logaddexp.reduce(ln))
        keys = map(tuple, chosen.tolist())
        for key, value, own, z in zip(keys, ln, of_labelled, mean, strict=True):
            total[key] = float(np.logaddexp(total.get(key, -np.inf), value))
            evidence[key] = float(np.logaddexp(evidence.get(key, -np.inf), own))
            if value > means.get(key, (-np.inf,))[0]:
                means[key] = (value, z)
    order = sorted(total, key=lambda key: (-total[key], key))
    ln = np.array([total[key] for key in order])
    probabilities = np.exp(ln - np.logaddexp.reduce(ln))
    chosen_modes = np.array(order).reshape(len(order), -1)
    likely = np.exp(np.array(strata) - np.logaddexp.reduce(strata))
    v = modes.H.shape[1]
    return Labelings(
        chosen_modes,
        probabilities,
        _of_each(chosen_modes, probabilities, (len(measured.y), len(modes.mu) + 1)),
        ln - [evidence[key] for key in order],
        means[order[0]][1][:v],
        float(likely @ DISCREPANCIES),
    )


def _of_each(modes: Array, probabilities: Array, shape: tuple[int, ...]) -> Array:
    """Probability (m, n + 1) of every mode of a frequency, the last of foreign."""
    each = np.zeros(shape)
    for own, p in zip(modes, probabilities, strict=True):
        each[range(len(own)), own] += p  # -1 is the last column
    return each


def discrepancy(labels: Sequence[Label], tau: float) -> Array:
    """Covariance (l, l) of ln f of l labelled modes: the error of form of each mode alone, and
    tau, which goes smoothly over the waves of a family, as what a model lacks does."""
    c = np.array([label.c for label in labels])
    family = _families(labels)
    alike = np.exp(-abs(c[:, None] - c) / ALIKE) * (family[:, None] == family)
    return np.diag([form_error(label) ** 2 for label in labels]) + tau**2 * alike


def _families(labels: Sequence[Label]) -> Array:
    """Place (l,) of each label's family in `FAMILIES`; of modes across the belt, by their
    parity."""
    return np.array([FAMILIES.index(x.family or FAMILIES[x.m % 2]) for x in labels])


def _tree(measured: Frequencies, modes: Modes, tau: float) -> tuple[Array, Array, Array, Array]:
    """Labelings (b, m) of the branches, ln of prior times evidence (b,), ln of the evidence of
    their labelled frequencies (b,) and the means of z (b, k): k = v + l variables and discrepancies
    of l different labels, these over `discrepancy`'s root. P (b, k, k): covariance of z."""
    different = list(dict.fromkeys(modes.labels))
    own = np.array([different.index(label) for label in modes.labels])
    root = np.linalg.cholesky(discrepancy(different, tau))
    H = np.hstack([modes.H, root[own]])
    sees = np.array(list(VIEWS))[:, _families(modes.labels)]  # (views, n)
    detection, lost = np.where(sees, 1 - MISSED, UNSEEN), np.where(sees, MISSED, 1 - UNSEEN)
    mode_of, ln_shape = np.arange(len(own)), np.zeros((len(measured.y), len(own)))
    if measured.ln_shape is not None:  # columns of the pairs' second modes are behind the others
        pairs = np.flatnonzero([label.c > 0 for label in modes.labels])
        mode_of = np.append(mode_of, pairs)
        ln_shape = measured.ln_shape[:, mode_of]
        detection = np.append(detection, np.full((len(sees), len(pairs)), SECOND), axis=1)
        lost = np.append(lost, np.full((len(sees), len(pairs)), 1 - SECOND), axis=1)
    mu, H, allowed = modes.mu[mode_of], H[mode_of], measured.allowed[:, mode_of]
    (count, n), k = allowed.shape, H.shape[1]
    is_second = np.arange(n) >= len(own)
    second = np.full(n, FOREIGN_MODE)  # column of the second mode of a pair, by that of the first
    second[mode_of[is_second]] = np.flatnonzero(is_second)
    width = float(np.ptp(measured.y)) + 2 * FOREIGN_MARGIN

    ln = np.log(list(VIEWS.values()))[None]  # (branches, views)
    of_labelled, mean, P = np.zeros(1), np.zeros((1, k)), np.eye(k)[None]
    free, chosen = ~is_second[None], np.empty((1, 0), int)
    for i in range(count):
        PH = P @ H.T  # (branches, k, n)
        noise = measured.s[i] ** 2 + SPLIT**2 * is_second
        variance = np.einsum("nk,bkn->bn", H, PH) + noise
        off = measured.y[i] - mu - mean @ H.T
        score = -0.5 * (off**2 / variance + np.log(2 * np.pi * variance))
        score[~(free & allowed[i])] = -np.inf
        foreign = -np.inf if measured.sure[i] else np.log(FOREIGN / width)
        grown = np.concatenate(
            [
                ln[:, None] + (score + ln_shape[i])[:, :, None] + np.log(detection.T),
                np.broadcast_to(ln[:, None] + foreign, (len(ln), 1, ln.shape[1])),
            ],
            axis=1,
        )
        total = np.logaddexp.reduce(grown, axis=2).ravel()
        best = np.argsort(-total, kind="stable")[:BRANCHES]
        best = best[total[best] > total[best[0]] - CUT]
        at, mode = np.divmod(best, n + 1)
        is_mode = mode < n
        j = np.where(is_mode, mode, 0)
        of_labelled = of_labelled[at] + np.where(is_mode, score[at, j], 0.0)
        column = PH[at, :, j] * is_mode[:, None]
        gain = column / variance[at, j][:, None]
        mean = mean[at] + gain * off[at, j][:, None]
        P = P[at] - gain[:, :, None] * column[:, None, :]
        ln, free = grown[at, mode], free[at]
        free[is_mode, j[is_mode]] = False
        has_second = is_mode & (second[j] != FOREIGN_MODE)
        free[has_second, second[j[has_second]]] = True
        chosen = np.hstack([chosen[at], np.where(is_mode, mode_of[j], FOREIGN_MODE)[:, None]])
    end = np.array([measured.y[measured.states == state].max() for state in modes.states])
    spread = np.sqrt(np.einsum("nk,bkl,nl->bn", H, P, H, optimize=True))
    missing = _missing((end[mode_of] - mu - mean @ H.T) / spread, free, lost)
    return chosen, np.logaddexp.reduce(ln + missing, axis=1), of_labelled, mean


def _missing(below: Array, free: Array, lost: Array) -> Array:
    """ln of the probability (branches, views) that the ``free`` modes (branches, n) were not
    measured: each is above the band, or was missed. below: of the band's end, in standard
    deviations; lost (views, n): probability of a mode within the band to be missed."""
    from scipy.special import ndtr

    within = ndtr(below)
    each = np.log1p(-within[:, None] * (1 - lost))
    return np.asarray((each * free[:, None]).sum(2))
