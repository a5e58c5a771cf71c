"""Where in the section the gap could lie: one part softer or stiffer, heavier or lighter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..inference.inverse_problem import InverseProblem
from ..inference.regions import SectionPart

Array = np.ndarray
STIFFNESS_PRIOR, MASS_PRIOR = 0.2, 0.1  # standard deviations of a part's relative change
SAME_COSINE = 0.95  # cosine of columns beyond which two parts cannot be told apart


@dataclass(frozen=True)
class PartChange:
    """A part of the section: the change of its stiffness, or of its mass, that alone fits the gap
    best."""

    region: str  # region of the section
    stiffness_percent: float  # change of stiffness that alone fits the gap best
    stiffness_sigma: float  # its standard deviation, percent
    mass_percent: float  # change of mass that alone fits the gap best
    mass_sigma: float  # its standard deviation, percent
    evidence: float  # ln evidence over no change, of the better one
    same_as: tuple[str, ...]  # parts whose change looks alike


@dataclass(frozen=True)
class FieldValue:
    """How far the section is off at one place, with the standard deviation before and after the
    data."""

    field: str  # what is off: meridian, gauges, stiffness or density of compounds, or the bead
    place: str  # place on the section
    value: float  # likeliest value
    sigma: float  # standard deviation after the data
    before: float  # standard deviation before the data
    unit: str  # unit of the value


def section_map(
    problem: InverseProblem, P: Array, residuals: Array, parts: Sequence[SectionPart]
) -> tuple[list[PartChange], int]:
    """Parts by falling evidence, and the number of their combinations that the data determine
    better than the prior.

    A part's relative change has the prior N(0, s^2). r (n,): residuals of the plain fit, P (n, n):
    that of `gap`, g: d eta by the change, a = g^T P g, b = g^T P r. The change is b / (a + 1/s^2),
    its evidence Z, that of no change Z0: ln Z / Z0 = b^2 / (a + 1/s^2) / 2 - ln(1 + s^2 a) / 2. In
    the code g is multiplied by s.
    """
    if not parts:
        return [], 0
    # d eta by ln of a part's stiffness or density, for all rows of the model
    columns = [(part.stiffness, STIFFNESS_PRIOR, part) for part in parts]
    columns += [(part.mass, MASS_PRIOR, part) for part in parts]
    G = np.array([g[problem.places] * s for g, s, _ in columns])
    gram = G @ P @ G.T
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    cosine = gram / np.outer(size, size)
    rank = int((np.linalg.eigvalsh(gram) > 1).sum())
    a, b = np.diag(gram), G @ P @ residuals
    change, sigma = b / (a + 1), 1 / np.sqrt(a + 1)
    ln = b**2 / (a + 1) / 2 - np.log1p(a) / 2
    count, result = len(parts), []
    for i, part in enumerate(parts):
        better = i if ln[i] >= ln[count + i] else count + i
        same = [
            columns[j][2].name
            for j in range(2 * count)
            if abs(cosine[better, j]) > SAME_COSINE and j % count != i
        ]
        stiffness, mass = (
            (float(100 * size * change[j]), float(100 * size * sigma[j]))
            for j, size in ((i, STIFFNESS_PRIOR), (count + i, MASS_PRIOR))
        )
        same_as = tuple(dict.fromkeys(same))
        result.append(PartChange(part.name, *stiffness, *mass, float(ln[better]), same_as))
    return sorted(result, key=lambda place: -place.evidence), rank
