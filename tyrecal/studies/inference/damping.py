"""Measured damping ratios as evidence, in addition to the frequencies.

    ln zeta = ln zeta0 + a(e) + J (x - x0) + error,   error ~ N(0, S)
    S = scatter^2 + DAMPING_FORM^2 (same mode) + L L^T

zeta, here the damping ratio: zeta_r = 1/2 sum_k eta_k w_rk, half the loss factors eta_k of the
compounds, weighted by their share w_rk of mode r's energy. a(e): what effects change, from the runs
of the expansion; J: by x, from differences of these runs; L (m, k): by one standard deviation of
each part of the loss factors, exact (`losses`). Uncertain constants of the case
move ln zeta by 2 %, [0,0] axial by 9 % (P235/75R17, section measured): `DAMPING_FORM` has them.

Given the frequencies, x ~ N(x_fit, N^-1), N: information of the fit. Integrated over x the
likelihood has S + J N^-1 J^T for S. x itself is that of the frequencies: damping, at 25 %, adds
nothing to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .observations import DampingRatios

Array = np.ndarray
# standard deviation of ln zeta of a mode, alike in all states, by judgement: the uncertain
# constants above, loss that changes with frequency and strain, and friction in the fixture
DAMPING_FORM = 0.1


@dataclass(frozen=True)
class DampingEvidence:
    """Likelihood of m damping ratios."""

    residual: Array  # (m,) of ln zeta at x0, without effects
    slopes: Array  # (m, v) J
    inverse: Array  # (m, m) S^-1
    ln_det: float  # ln |S|

    @classmethod
    def of(cls, seen: DampingRatios, at_x0: Array, slopes: Array, losses: Array) -> DampingEvidence:
        """at_x0 (m,): ln zeta of the model; losses (m, k): L. Rows that it does not know are left
        out."""
        known = np.isfinite(at_x0)
        labels = [row.label for row in seen.rows]
        same = np.array([[float(a == b) for b in labels] for a in labels])
        S = np.diag(seen.scatter**2) + DAMPING_FORM**2 * same + losses @ losses.T
        inverse = np.zeros_like(S)
        inverse[np.ix_(known, known)] = np.linalg.inv(S[np.ix_(known, known)])
        ln_det = np.linalg.slogdet(S[np.ix_(known, known)])[1]
        residual = np.where(known, seen.y - at_x0, 0.0)
        return cls(residual, np.where(known[:, None], slopes, 0.0), inverse, float(ln_det))

    @property
    def count(self) -> int:
        """Number of damping ratios that are used."""
        return int(np.count_nonzero(np.diag(self.inverse)))

    def ln_likelihood(self, added: Array, d: Array, information: Array) -> Array:
        """ln p (q,) with changes ``added`` (q, m) by effects, at fits x - x0 = d (q, v) whose
        information is (q, v, v)."""
        r = self.residual - added - d @ self.slopes.T
        weighted = r @ self.inverse
        # S + J N^-1 J^T by Woodbury's identity and the determinant lemma
        pull = weighted @ self.slopes
        more = information + self.slopes.T @ self.inverse @ self.slopes
        chi2 = (weighted * r).sum(1)
        chi2 -= (pull * np.linalg.solve(more, pull[:, :, None])[:, :, 0]).sum(1)
        ln_det = self.ln_det + np.linalg.slogdet(more)[1] - np.linalg.slogdet(information)[1]
        return np.asarray(-(chi2 + ln_det + self.count * np.log(2 * np.pi)) / 2)
