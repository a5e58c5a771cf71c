"""Exact derivatives of eigenvalues by numbers of the deck, the preload's change included.

    d lambda/dp = phi^H (dK/dp + D_u K[v] - lambda dM/dp) phi,    v = -K0^-1 dr/dp

(Nelson's first-order formula, phi^H M phi = 1.) r(u, p) = 0: out-of-balance force of the inflated
state u; K0 = dr/du. All three terms come from one complex step: the quadratic forms of phi are
evaluated on the model of the deck with its number p + i h, at the state u + i h v; no second
derivative is written out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from ...language.text import COMPLEX_STEP
from ..section import mechanics
from ..section.kept_fields import Coordinates, Factor
from ..section.loads import Spin
from ..section.model import Model
from ..section.parts.part import IN_PLANE, ModeShapes, TyrePart
from .cavity import GasCavity, coupling
from .wheel import Wheel

Array = np.ndarray


def state_rate(
    model: Model, U: Array, loads: Sequence[TyrePart], numbering: Coordinates, factor: Factor
) -> Array:
    """v = dU/dp (n, 3) of the equilibrium U; ``model``, ``loads`` carry p's tangent.

    ``factor``: of the real Newton tangent K0 at U.
    """
    rate = np.imag(mechanics.gradient(model, U, loads)) / COMPLEX_STEP  # dr/dp
    rate = numbering.gather(model.mesh.symmetry.force(rate))  # of the whole tyre, by equation
    return np.asarray(numbering.spread(-factor.solve(rate)).real)


def eigenvalue_rates(
    model: Model,
    U: Array,
    V: Array,
    loads: Sequence[TyrePart],
    fields: ModeShapes,
    eigenvalues: Array,
    rim_and_air: RimAndAir | None = None,
) -> Array:
    """d lambda/dp (m,) of the modes ``fields``, lambda (m,).

    ``model`` and ``loads`` carry the tangent of p, V = dU/dp; ``rim_and_air``: what moves along,
    None: nothing. If the model has tables of moduli, lambda changes its own modulus, rho times the
    static one: d lambda/dp = (d lambda/dp at that modulus) / (1 - d lambda/d rho d rho/d lambda).
    """
    state = U + 1j * COMPLEX_STEP * V
    if rim_and_air:
        fields = rim_and_air.carried(model.mesh.X, fields)
    total = np.zeros(len(eigenvalues), complex)
    denominator, copies = 1.0, model.mesh.symmetry.copies
    spins = [load for load in loads if isinstance(load, Spin)]
    for part in (*model.parts, *(load for load in loads if not isinstance(load, Spin))):
        total += part.form(state, fields)
        for i, table in enumerate(model.tables):
            if (grown := part.frequency_dependent_part(i)) is not None:
                form = grown.form(state, fields)
                hertz = np.sqrt(eigenvalues) / (2 * np.pi)
                ratio = np.array([table.ratio(f) for f in hertz])
                total += (ratio - 1) * form
                # d rho / d lambda = rho (d ln rho / d ln f) / (2 lambda)
                slope = np.array([table.slope(f) for f in hertz])
                own_change = copies * form.real * ratio.real * slope / (2 * eigenvalues)
                denominator = denominator - own_change
    M = mechanics.mass(model)
    total -= eigenvalues * _energies(M, fields).sum(1)
    if spins:  # centrifugal: -Omega^2 M in r and theta, of all parts at once, as Omega is one
        total -= _energies(spins[0].spin2 * M, fields) @ np.diag(IN_PLANE)
    total *= copies
    if rim_and_air:
        total += rim_and_air.forms(model, state, loads, fields, eigenvalues)
    return total.imag / COMPLEX_STEP / denominator


@dataclass(frozen=True)
class RimAndAir:
    """Rim and air with the tangent of a number p, and the amplitudes of their motions in each
    mode."""

    wheel: Wheel | None  # None: the rim is held
    air: GasCavity | None  # None: it is a constant pressure
    rim: list[Array]  # of each mode (q,), of the q motions of the rim
    flow: list[Array]  # of each mode (w,), of the w terms of the air's flow, kg/m

    def carried(self, X: Array, fields: ModeShapes) -> ModeShapes:
        """The modes with the rim's nodes where p's tangent in X (nodes, 2) takes them."""
        if self.wheel is None or not np.iscomplexobj(X):
            return fields
        real, imag = fields.shapes.real.astype(complex), fields.shapes.imag.astype(complex)
        for j, q in enumerate(self.rim):
            a, b = (part[self.wheel.rim] for part in self.wheel.fields(int(fields.n[j]), X))
            real[j, self.wheel.rim] = a @ q.real - b @ q.imag
            imag[j, self.wheel.rim] = a @ q.imag + b @ q.real
        return fields.replaced(real, imag)

    def forms(
        self,
        model: Model,
        state: Array,
        loads: Sequence[TyrePart],
        fields: ModeShapes,
        eigenvalues: Array,
    ) -> Array:
        """Part of the rim and the gas in phi^H (K - lambda M) phi per mode (m,), complex: with the
        tangent of the number p of the deck. The gas: as in `cavity`, with its Q, H, C and w."""
        total = np.zeros(len(eigenvalues), complex)
        X = model.mesh.X
        forces = mechanics.gradient(model, state, loads) if self.wheel else state
        of_whole_tyre = model.mesh.symmetry.force
        forces = of_whole_tyre(forces.real) + 1j * of_whole_tyre(forces.imag)
        couplings = {n: coupling(self.air, X, state, n) for n in set(fields.n.tolist()) if self.air}
        for j, ((n,), (real,), (imag,)) in enumerate(fields.modes):  # one harmonic n per mode
            if self.wheel:
                stiffness, inertia = self.wheel.own(int(n), X, forces)
                total[j] += (stiffness - eigenvalues[j] * inertia) @ abs(self.rim[j]) ** 2
            for part, w in ((real, self.flow[j].real), (imag, self.flow[j].imag)):
                if n in couplings:
                    air = couplings[n]
                    H = air.H[air.flowing, air.flowing]
                    swept = air.strain(part, w)
                    total[j] += swept @ np.linalg.solve(air.Q, swept)
                    total[j] -= eigenvalues[j] * (w @ H @ w)
        return total


def _energies(M: csr_array, fields: ModeShapes) -> Array:
    """u^H M u (m, 3) per mode and component. Where shapes carry no tangent of p, only the part that
    does, which is imaginary: that of M, or zero."""
    if not (fields.complex or np.iscomplexobj(M)):
        return np.zeros((len(fields.modes), 3), complex)
    if not fields.complex:
        M = M.imag
    energy: Array = np.zeros((len(fields.n), 3), fields.real.dtype)
    for part in (fields.real, fields.imag):
        u = np.moveaxis(part, 0, -1)  # (nodes, 3, shapes)
        energy = energy + ((M @ u.reshape(len(u), -1)).reshape(u.shape) * u).sum(0).T
    energy = fields.summed(energy)
    return energy if fields.complex else 1j * energy
