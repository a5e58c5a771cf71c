"""How hard a trial is, by a ruler made before the study: sensitivities, covariance, signatures.

    P = S^-1 - S^-1 J (J^T S^-1 J + Sx^-1)^-1 J^T S^-1        S: noise + form + constants,
                                                              Sx: prior covariance of ln x
    lambda = g^T P g + splits                                  g: the true effect, noise-free
    delta_j^2 = min over e_j of (g - g_j)^T P (g - g_j) + splits

S, J and the catalogue's g_j come from the plain case at its start, J and g_j moved to the trial's
own design to first order; g from the maker's runs with and without. Splits of pairs, s of the true
effect and s_j of effect j, add ((s - s_j) / tau)^2, tau^2 = 2 noise^2 + (the tyre's own split)^2.
Covariance and projection are written here again, not the diagnosis' own: a mistake of its would be
one of its judge's.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import Json
from ...simulate.modes.label import Label
from ..inference.covariance import LAWS_LENGTH, form_error
from ..inference.model import Answer, ModelRow, Query, ResponseModel, state_of
from .protocol import Protocol, read_json

Array = np.ndarray
RULER_FILE = "ruler.json"
CURVATURE_STEP = 0.05  # of ln x, for the curvature
SHARES = (0.15, 0.5, 1.0)  # of each side of a range
SIZE_POINTS = 61  # of the grid over the sizes of an effect
BETWEEN_PRESSURES = 0.9  # correlation of form errors: as all studies on record were scored
NUMBERS = ("x0", "spread", "eta", "jacobian", "hessian", "constants")
SIGNATURE = ("sizes", "shift", "tilt", "split")
LAWS = ("material_laws", "laws_shared", "laws_length")


@dataclass(frozen=True)
class EffectShifts:
    """An effect on all rows."""

    sizes: Array  # (k,) with 0
    shift: Array  # (k, n) of eta
    tilt: Array  # (k, n, v) shift of J
    split: Array  # (k, n) between a pair's two modes, in ln f

    @cached_property
    def _weights(self) -> Array:
        """Weights (q, k) of the given sizes at those of `grid`: parabolas through the three that
        are nearest, lines between two."""
        weights = np.zeros((SIZE_POINTS, len(self.sizes)))
        for q, value in enumerate(np.linspace(self.sizes[0], self.sizes[-1], SIZE_POINTS)):
            chosen = np.sort(np.argsort(abs(self.sizes - value), kind="stable")[:3])
            for k in chosen:
                others = self.sizes[chosen[chosen != k]]
                weights[q, k] = np.prod((value - others) / (self.sizes[k] - others))
        return weights

    def grid(self, d: Array, places: Array) -> tuple[Array, Array, Array]:
        """Sizes (q,) from end to end, shift (q, n) at x0 + d, split (q, n), rows ``places``
        alone."""
        e = np.linspace(self.sizes[0], self.sizes[-1], SIZE_POINTS)
        shift = self.shift + self.tilt @ d
        return e, (self._weights @ shift)[:, places], (self._weights @ self.split)[:, places]


@dataclass(frozen=True)
class Ruler:
    """The plain case at its start x0, and the catalogue's effects there."""

    rows: tuple[ModelRow, ...]
    x0: Array  # (v,) logarithms of the variables' start values
    spread: Array  # (v,) prior of ln x
    eta: Array  # (n,) ln f, Hz, and ln mass, kg
    jacobian: Array  # (n, v) d eta / d ln x
    hessian: Array  # (n, v, v) by ln x twice
    constants: Array  # (n, k) change by one standard deviation of each
    signatures: Mapping[str, EffectShifts]
    material_laws: float = 0.0  # standard deviation of each part
    laws_shared: bool = True  # by a family, and by all modes, too
    laws_length: float = LAWS_LENGTH  # of ln p, over which that is alike

    def sigma(self, places: Array, counts: Array, protocol: Protocol) -> Array:
        """Covariance (n, n) of such rows: repeatability, form, material laws and constants."""
        labels, states = zip(*(self.rows[i] for i in places), strict=True)
        is_mass = np.array([label is None for label in labels])
        same = np.array([[a == b for b in labels] for a in labels])
        alike = np.where(np.eye(len(labels), dtype=bool), 1.0, BETWEEN_PRESSURES) * same
        form = np.array([form_error(label) for label in labels])
        ln_p = np.log([state_of(where).pressure_kPa or 1.0 for where in states])
        near = np.exp(-(((ln_p[:, None] - ln_p) / self.laws_length) ** 2) / 2)
        families = [label.family if label else None for label in labels]
        kin = np.array([[a is not None and a == b for b in families] for a in families])
        parts = same + (kin + 1.0 if self.laws_shared else 0.0)
        laws = self.material_laws**2 * parts * near * np.outer(~is_mass, ~is_mass)
        g = self.constants[places]
        scatter = np.where(is_mass, protocol.mass, protocol.noise) ** 2 / counts
        return np.asarray(np.diag(scatter) + alike * np.outer(form, form) + laws + g @ g.T)

    def plain(self, d: Array, places: Array) -> tuple[Array, Array]:
        """eta (n,), J (n, v) at x0 + d without effects."""
        J, bent = self.jacobian[places], self.hessian[places] @ d
        return self.eta[places] + J @ d + bent @ d / 2, J + bent

    def projection(self, d: Array, places: Array, sigma: Array) -> Array:
        """P (n, n) at x0 + d."""
        inverse = np.linalg.inv(sigma)
        J = self.plain(d, places)[1]
        inner = J.T @ inverse @ J + np.diag(self.spread**-2.0)
        return np.asarray(inverse - inverse @ J @ np.linalg.solve(inner, J.T @ inverse))


@dataclass(frozen=True)
class Difficulty:
    """How hard an effect is to see, and to distinguish from others."""

    lam: float  # lambda
    nearest: float  # min_j delta_j^2 over other effects
    group: tuple[str, ...]  # the effect and those with delta_j^2 < 9
    equivalent: float | None  # the catalogue's parameter that comes closest to the true effect

    @property
    def band(self) -> float:
        """min(lambda, min_j delta_j^2)."""
        return min(self.lam, self.nearest)


MIN_LAMBDA_APART = 9.0  # lambda between two effects, below which they look the same


def difficulty(
    ruler: Ruler,
    protocol: Protocol,
    law: str,
    d: Array,
    places: Array,
    counts: Array,
    moved: tuple[Array, Array],
) -> Difficulty:
    """Difficulty of a true effect by how it moved the measured rows ``places``: its shift of ln f
    (n,), and the distance that it adds to pairs (n,); d: the trial's design minus x0."""
    shift, split = moved
    P = ruler.projection(d, places, ruler.sigma(places, counts, protocol))
    tau2 = 2 * protocol.noise**2 + protocol.split**2
    pairs = counts == 2
    lam = float(shift @ P @ shift + (split[pairs] ** 2).sum() / tau2)
    distances, equivalent = {}, None
    for id, signature in ruler.signatures.items():
        e, g, s = signature.grid(d, places)
        off = g - shift
        apart = ((np.abs(s) - np.abs(split))[:, pairs] ** 2).sum(1) / tau2
        length = np.einsum("qn,nm,qm->q", off, P, off) + apart
        if id == law:
            equivalent = float(e[np.argmin(length)])
        else:
            distances[id] = float(length.min())
    near = [id for id, distance in distances.items() if distance < MIN_LAMBDA_APART]
    return Difficulty(lam, min(distances.values(), default=np.inf), (law, *near), equivalent)


def measure(model: ResponseModel, rows: Sequence[ModelRow]) -> Json:
    """The ruler as plain data. Raises the model's failure where the plain tyre has no solution."""
    x0 = np.asarray(model.start, float)
    steps = CURVATURE_STEP * np.eye(len(x0))
    plain = [Query(x0, constants=True), *(Query(x0 + side * d) for d in steps for side in (1, -1))]
    effects = [
        (id, e)
        for id, span in model.ranges.items()
        for e in sorted({f * end for end in (span.low, span.high) if end for f in SHARES})
    ]
    # all at once: one count of the progress
    answers = model.answers([*plain, *(Query(x0, {id: e}) for id, e in effects)])
    first, *around = answers[: len(plain)]
    for answer in (first, *around):
        if not isinstance(answer, Answer):
            raise answer
    assert isinstance(first, Answer) and first.constants is not None
    slopes = np.array([a.jacobian for a in around])  # type: ignore[union-attr]
    hessian = np.moveaxis(slopes[::2] - slopes[1::2], 0, -1) / (2 * CURVATURE_STEP)
    signatures = {}
    with_effects = dict(zip(effects, answers[len(plain) :], strict=True))
    for id in model.ranges:
        known = {e: a for (of, e), a in with_effects.items() if of == id and isinstance(a, Answer)}
        if known:
            known[0.0] = Answer(first.eta, first.jacobian, 0 * first.split)
            each = [known[e] for e in sorted(known)]
            signatures[id] = {
                "sizes": sorted(known),
                "shift": [_rounded(a.eta - first.eta) for a in each],
                "tilt": [_rounded(a.jacobian - first.jacobian) for a in each],
                "split": [_rounded(a.split) for a in each],
            }
    return {
        "format": 1,
        "rows": [["mass" if label is None else str(label), p] for label, p in rows],
        "x0": x0.tolist(),
        "spread": np.asarray(model.spread).tolist(),
        "eta": first.eta.tolist(),
        "jacobian": first.jacobian.tolist(),
        "hessian": _rounded((hessian + hessian.transpose(0, 2, 1)) / 2),
        "constants": _rounded(first.constants),
        "signatures": signatures,
        "material_laws": model.material_laws,
        "laws_shared": True,
        "laws_length": LAWS_LENGTH,
    }


def read_ruler(folder: Path) -> Ruler:
    """The ruler of ``folder``. Raises InputError."""
    try:
        return ruler_of(read_json(folder / RULER_FILE))
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f"{folder / RULER_FILE}: not a ruler of trials ({error})") from None


def ruler_of(content: Json) -> Ruler:
    """The ruler from the data of `measure`. Raises KeyError, ValueError, TypeError where they are
    none."""
    fields: Json = {key: np.array(content[key], float) for key in NUMBERS}
    fields |= {key: content[key] for key in LAWS}
    signatures = {
        id: EffectShifts(*(np.array(each[key], float) for key in SIGNATURE))
        for id, each in content["signatures"].items()
    }
    rows = tuple((_label(name), float(p)) for name, p in content["rows"])
    return Ruler(rows, **fields, signatures=signatures)


def _label(name: str) -> Label | None:
    """The label that `measure` wrote; None of the mass."""
    if name == "mass":
        return None
    numbers, _, kind = name.partition(" ")
    c, m = json.loads(numbers)
    return Label(c, m, kind or None)


def _rounded(values: Array) -> list:
    """Nine decimals: 1e-7 % of a frequency."""
    return np.round(values, 9).tolist()
