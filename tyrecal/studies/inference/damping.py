"""Measured damping ratios as evidence, in addition to the frequencies.

    ln zeta = ln zeta0 + a(e) + J (x - x0) + error,   error ~ N(0, S)
    S = scatter^2 + DAMPING_FORM^2 (same mode) + L L^T

zeta, here the damping ratio: zeta_r = 1/2 sum_k eta_k w_rk, half the loss factors eta_k of the
compounds, weighted by their share w_rk of mode r's energy. a(e): what effects change, from the runs
of the expansion; J: by x, from differences of these runs; L (m, k): by one standard deviation of
each part of the loss factors, exact (`loss_deviations`). Uncertain constants of the case move ln
zeta by 2 %, [0,0] axial by 9 % (P235/75R17, section measured): `DAMPING_FORM` has them.

Given the frequencies, x ~ N(x_fit, N^-1), N: information of the fit. Integrated over x the
likelihood has S + J N^-1 J^T for S. x itself is that of the frequencies: damping, at 25 %, adds
nothing to it.

Damping ratios depend on the loss factors of compounds, and no frequency does:

    zeta_r = 1/2 sum_m eta_m w_rm,   d ln zeta_r / d ln eta_m = eta_m w_rm / (2 zeta_r)

zeta_r: damping ratio of mode r, eta_m: loss factor of compound m, w_rm: its share of the mode's
energy. The derivative is its share of the mode's loss. Shares sum to 1, so that compounds which are
all off alike move all modes alike: then only the ratios between modes carry information.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np

from ...tyre.case import LoadedCase, number_at
from ...tyre.case.schema import Rubber
from ...tyre.effects.edit import changed, with_part, with_rubbers
from .observations import DampingRatios
from .section_fields import COMPOUNDS_ALIKE  # correlation, here of the ln of their loss factors

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


# loss factor of a compound that states none, and standard deviation of its ln, by judgement: 0.08
# to 0.3 are usual for rubbers of tyres at 20 to 60 C and small strain
ASSUMED_LOSS, ASSUMED_LOSS_SD = 0.15, 0.7
# standard deviation of the ln of a stated one, by judgement: another batch, strain or temperature
STATED_LOSS_SD = 0.15


def with_losses(case: LoadedCase) -> LoadedCase:
    """The case with a loss factor in each compound."""
    return with_rubbers(case, lambda m: with_part(m, loss_factor=m.loss_factor or ASSUMED_LOSS))


def with_twice_the_loss(case: LoadedCase, name: str) -> LoadedCase:
    """The case with twice the loss factor of a compound."""
    rubber = case.case.materials[name]
    assert isinstance(rubber, Rubber)
    loss = rubber.loss_factor or 0.0
    twice = [[hertz, 2 * eta] for hertz, eta in loss] if isinstance(loss, list) else 2 * loss
    other = {name: with_part(rubber, loss_factor=twice)}
    return changed(case, materials={**case.case.materials, **other})


def losses_in_words(case: LoadedCase) -> str:
    """Loss factors of a case as a diagnosis takes them."""
    compounds = {k: m for k, m in case.case.materials.items() if isinstance(m, Rubber)}
    assumed = ", ".join(name for name, m in compounds.items() if not m.loss_factor)
    if not assumed:
        known = "the case states them" if compounds else "the deck has them"
        return f"loss factors as {known}"
    factor = f"within a factor of {exp(ASSUMED_LOSS_SD):.1g} (one standard deviation)"
    return f"loss factor {ASSUMED_LOSS:g} assumed of {assumed}, {factor}"


def loss_deviations(case: LoadedCase) -> dict[str, Array]:
    """Deviations (k,) of ln eta by compound, each of k independent parts at one standard deviation.

    By ``uncertainties`` of the case that set loss factors; of other compounds as above. Without
    compounds, in a deck of a user, one part that all modes share, by the key "".
    """
    compounds = {k: m for k, m in case.case.materials.items() if isinstance(m, Rubber)}
    names = list(compounds) or [""]
    parts: list[Array] = []
    for each in (case.case.uncertainties or {}).values():
        part = np.zeros(len(names))
        for path, sign in zip(each.sets, each.signs or [1] * len(each.sets), strict=True):
            name = path.removeprefix("materials.").removesuffix(".loss_factor")
            if path.endswith(".loss_factor") and name in compounds:
                size = each.absolute / number_at(case, path) if each.absolute else 0.0
                part[names.index(name)] = sign * (size or (each.percent or 0.0) / 100)
        parts += [part] * bool(part.any())
    free = ~np.any(parts, axis=0) if parts else np.ones(len(names), bool)
    stated = [not compounds or bool(compounds[name].loss_factor) for name in names]
    size = np.where(stated, STATED_LOSS_SD, ASSUMED_LOSS_SD) * free
    parts.append(np.sqrt(COMPOUNDS_ALIKE) * size)
    parts += list(np.sqrt(1 - COMPOUNDS_ALIKE) * np.diag(size))
    return dict(zip(names, np.array(parts).T, strict=True))
