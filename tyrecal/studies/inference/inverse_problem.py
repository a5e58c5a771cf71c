"""Observations and the model: one set of rows, covariance and prior for every hypothesis.

    y = eta(x, e) + error,   error ~ N(0, Sigma),   x ~ N(centre, spread^2)

y (n,): ln of the measured values; eta: the model's rows (`model`); Sigma: see `covariance`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .covariance import alike, covariance
from .damping import DampingEvidence
from .expansion import Expansion
from .model import EffectRange
from .observations import DampingRatios, Observations
from .splits import Splits
from .veering import Veering, rule, veering

Array = np.ndarray


@dataclass(frozen=True)
class Toggle:
    """Change of one effect in a toggled run."""

    id: str  # of the effect
    value: float  # that it was set to or, if ``times``, the factor on what it was
    times: bool = False
    base: float = 0.0  # what the case has of it, from which the parameter counts

    def applied(self, effects: Mapping[str, Array], count: int) -> dict[str, Array]:
        """Parameters (count,) of effects in the toggled run."""
        old = effects.get(self.id, np.zeros(count))
        new = (self.base + old) * self.value if self.times else np.full(count, self.value)
        return {**effects, self.id: new - self.base}


@dataclass(frozen=True)
class Assumed:
    """Numbers, all of them relative, that the diagnosis takes for granted and states."""

    # standard deviation of the model's error in ln f of every mode; None: the recorded one of each
    # mode (`form_error`), and that of material laws
    form: float | None = None
    # standard deviation, in ln f, of the distance of the two modes of a pair by non-uniformity
    split: float = 0.003
    # standard deviation of the error of an effect's shift over that shift; None: that of each
    # effect (`Effect.response_error`)
    response_error: float | None = None
    further: float = 0.05  # prior of k + 1 effects over that of k, from k = 1 on


class Added(NamedTuple):
    """Contribution of k effects to eta = ln f at parameters (q,), and its uncertainty."""

    shift: Array  # (q, n) change of eta at x0
    tilt: Array  # (q, n, v) change of the sensitivities d eta / dx
    split: Array  # (q, n) distance of the two modes of a pair with the effects, in ln f
    off: Array  # (k, q, n) standard deviation of the shift by `response_error`, mode by mode
    # (k, q, n) shift by one standard deviation of `Effect.shape_uncertainty`
    shape_uncertainty: Array
    damping: Array  # (q, m) change of the ln of the measured damping ratios


@dataclass(frozen=True)
class InverseProblem:
    """n observations and the model of them, in v variables x as `model` has them."""

    observations: Observations = field(repr=False)
    expansion: Expansion = field(repr=False)
    ranges: Mapping[str, EffectRange] = field(repr=False)
    places: Array  # (n,) of the observations among the model's rows
    centre: Array  # (v,) mean of the prior of x
    spread: Array  # (v,) standard deviation of the prior of x
    changes: tuple[Toggle, ...] = ()  # the effect that was switched in each of runs 1, 2, ...
    assumed: Assumed = Assumed()
    # factors on the standard deviations of some sources of error, by their index
    reduced: Mapping[int, float] = field(default_factory=dict)
    zeta: float = 0.0  # coupling of near modes, in its standard deviations: see `veering`
    # (m,) of the measured damping ratios among the model's rows
    damping_places: Array = field(default_factory=lambda: np.zeros(0, int))

    @property
    def constants(self) -> Array:
        """Change (n, k) of eta by one standard deviation of each of k sources of error."""
        known = self.expansion.constants[self.places].copy()
        for k, factor in self.reduced.items():
            known[:, k] *= factor
        return known

    @cached_property
    def sigma(self) -> Array:
        """Sigma (n, n): covariance of y - eta without effects."""
        mixed = self.mixed if self.zeta else None
        return self.covariance(self.observations, self.constants, mixed)

    def covariance(
        self, observations: Observations, constants: Array, mixed: Array | None = None
    ) -> Array:
        """Covariance of other observations, whose constants (m, k) are given."""
        laws = self.expansion.material_laws  # standard deviation of their error, in ln f
        return covariance(observations, constants, laws, self.assumed.form, mixed)

    @cached_property
    def splits(self) -> Splits:
        """Splits of the pairs."""
        return Splits.of(self.observations, self.assumed.split)

    @cached_property
    def integrand(self) -> list[InverseProblem]:
        """The problem at each zeta of `veering.rule`; empty if no modes are coupled."""
        if not self.veering.active:
            return []
        return [replace(self, zeta=float(z)) for z in rule()[0]]

    @cached_property
    def damping(self) -> DampingEvidence | None:
        """The measured damping ratios; None if there are none, or the model computes none."""
        e, seen = self.expansion, self.observations.damping
        if not seen.rows or e.damping is None or e.damping_slopes is None:
            return None
        at = self.damping_places
        losses = np.zeros((len(e.damping), 0)) if e.losses is None else e.losses
        return DampingEvidence.of(seen, e.damping[at], e.damping_slopes[at], losses[at])

    @cached_property
    def veering(self) -> Veering:
        """Which rows are coupled."""
        e = self.expansion
        return veering(self.observations, self.places, e.eta, e.coupling)

    @cached_property
    def mixed(self) -> Array:
        """d ln f of coupled modes by ln f of uncoupled ones (n, n), as they were measured."""
        return self.veering.weights(self.observations.y, self.zeta)

    def only(self, keep: Array) -> InverseProblem:
        """The problem with the rows of a mask (n,) alone."""
        return replace(self, observations=self.observations.only(keep), places=self.places[keep])

    def measured(self, y: Array) -> InverseProblem:
        """The problem with other values (n,) in the same rows."""
        return replace(self, observations=replace(self.observations, y=y))

    def plain(self, d: Array) -> tuple[Array, Array]:
        """eta (n,) and J = d eta / dx (n, v) at x0 + d without any effect, switched or not."""
        eta, jacobian = self.expansion.plain(self.expansion.x0 + d)
        eta, jacobian, _ = self.veering.coupled(eta[self.places], jacobian[self.places], self.zeta)
        return eta, jacobian

    def predicted(self, effects: Mapping[str, Array], d: Array) -> Array:
        """eta (q, n) at x0 + d (q, v) with effects, each (q,)."""
        plain = replace(self, zeta=0.0)
        shift, tilt, *_ = plain.added(effects, len(d))
        eta = np.array([plain.plain(each)[0] for each in d]) + shift
        return self.veering.coupled(eta + np.einsum("qnv,qv->qn", tilt, d), tilt, self.zeta)[0]

    def added(self, effects: Mapping[str, Array], count: int) -> Added:
        """Contribution of effects, each (count,). Squares of splits add up, each counted from the
        plain tyre's."""
        n, v = len(self.places), len(self.expansion.x0)
        shift, tilt = np.zeros((count, n)), np.zeros((count, n, v))
        own = self.expansion.split[self.places] ** 2
        square = np.tile(own, (count, 1))
        runs = np.array([row.run for row in self.observations.rows])
        ids = [id for id in self.expansion.nodes if id in effects or id in self._switched]
        off, shape_uncertainty = np.zeros((2, len(ids), count, n))
        damping = np.zeros((count, len(self.damping_places)))
        for id in [id for id in self.expansion.nodes if id in effects and damping.size]:
            every = self.expansion.nodes[id].damping_at(effects[id])
            damping += every[:, self.damping_places]
        for run in sorted(set(runs.tolist())):
            rows = np.flatnonzero(runs == run)
            here = dict(effects)
            if run and self.changes:
                here = self.changes[run - 1].applied(here, count)
            for id, e in here.items():
                if id in self.expansion.nodes:
                    a, B, s = self.expansion.nodes[id].at(e)
                    shift[:, rows] += a[:, self.places[rows]]
                    tilt[:, rows] += B[:, self.places[rows]]
                    square[:, rows] += s[:, self.places[rows]] ** 2 - own[rows]
                    off[ids.index(id)][:, rows] = self._response_error(id) * a[:, self.places[rows]]
                    more = self.expansion.nodes[id].shape_uncertainty_at(e)
                    shape_uncertainty[ids.index(id)][:, rows] = more[:, self.places[rows]]
            # joint: what two effects together change beyond the sum of both
            for both, joint in self.expansion.joint.items():
                if set(both) <= set(here):
                    a, B = joint.at(*(here[id] for id in both))
                    shift[:, rows] += a[:, self.places[rows]]
                    tilt[:, rows] += B[:, self.places[rows]]
        if self.zeta:
            shift, tilt = shift @ self.mixed.T, self.mixed @ tilt
        split = np.sqrt(np.maximum(square, 0.0))
        added = Added(shift, tilt, split, off, shape_uncertainty, damping)
        return self.with_mixed_laws(added)

    def with_mixed_laws(self, added: Added) -> Added:
        """``off`` and ``shape_uncertainty`` transformed to the coupled modes (`mixed`)."""
        if not self.zeta:
            return added
        by_mode, by_shape = added.off @ self.mixed.T, added.shape_uncertainty @ self.mixed.T
        return added._replace(off=by_mode, shape_uncertainty=by_shape)

    def response_covariance(self, added: Added) -> Array:
        """Covariance (q, n, n) of the errors of what effects add to eta."""
        return np.add(*self.response_covariances(added))

    def response_covariances(self, added: Added) -> tuple[Array, Array]:
        """The two parts (q, n, n) of `response_covariance`: by `Effect.response_error`, mode by
        mode, and by `Effect.shape_uncertainty`."""
        off, shape = (each.transpose(1, 2, 0) for each in (added.off, added.shape_uncertainty))
        by_mode = off @ off.swapaxes(1, 2) * self._alike
        return np.asarray(by_mode), np.asarray(shape @ shape.swapaxes(1, 2))

    def _response_error(self, id: str) -> float:
        stated = self.assumed.response_error
        return self.ranges[id].response_error if stated is None else stated

    @property
    def _switched(self) -> list[str]:
        return [change.id for change in self.changes]

    @cached_property
    def _alike(self) -> Array:
        """Correlation (n, n) of errors of one mode at several states; 0 between modes."""
        return alike(self.observations.rows)


def places(observations: Observations | DampingRatios, rows: Sequence[tuple]) -> Array:
    """Index (n,) of each observation among the model's rows."""
    known = {row: i for i, row in enumerate(rows)}
    return np.array([known[row.row] for row in observations.rows], int)
