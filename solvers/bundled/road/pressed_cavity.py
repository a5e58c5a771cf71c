"""Sound in the pressed tyre's cavity: the first wave round it, which the patch splits in two.

Air between rigid walls as they stand, p = sum P_km psi_m(r, z) T_k(phi), psi_m the monomials of
`modes.cavity`, T_k = 1, cos k phi, sin k phi, phi the angle in space from the patch's middle:

    H P = omega^2 Q P,   Q = 1/B int p p dV,   H = 1/rho int grad p . grad p dV

(Rayleigh and Ritz; Morse and Ingard, Theoretical Acoustics, 9.1.) Of a thin torus with the area
A(phi) of its section this is Webster's equation (A p')' + (omega R / c)^2 A p = 0 (': d/dphi, R:
the torus' radius, c: speed of sound): the even wave, with its pressure at the patch, pushes the
wheel up and down, the odd one fore and aft; with A = A0 (1 + a cos 2 phi) they have c / (2 pi R) (1
-+ a / 2), the upper sign for the even one. Narrow at the patch, a < 0.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

from ..modes.cavity import ACROSS, ACROSS_WEIGHTS, POINTS_ALONG, GasCavity, middle, monomials
from ..section import elements
from ..section.parts.part import SPIN_AXIS, cross

Array = np.ndarray
WAVES_ROUND = 6  # highest wave round the tyre
STATIONS_ROUND = 64  # round the tyre


def cavity_modes(air: GasCavity, X: Array, displacement: Array, angles: Array) -> Array:
    """Hz of the first wave's fore-aft and vertical mode (2,).

    X (n, 2): R, Z of the nodes at rest, m; displacement (ring, n, 3): r, theta, z at the reference
    angle, of rings at ``angles``, 0 <= angle < 2 pi and rising; one ring: a tyre of revolution.
    """
    theta = np.arange(STATIONS_ROUND) * 2 * np.pi / STATIONS_ROUND
    rows = np.concatenate([displacement, displacement[:1]])
    u = CubicSpline(np.append(angles, angles[0] + 2 * np.pi), rows, bc_type="periodic")
    U, U_around = u(theta), u(theta, 1)
    parts = [_wall(X, surface.connectivity, U, U_around) for surface in air.surfaces]
    x, normal = (np.concatenate(each, 1) for each in zip(*parts, strict=True))
    r, z = np.hypot(x[..., 0], x[..., 1]), x[..., 2]
    phi = theta[:, None] + np.arctan2(x[..., 1], x[..., 0])
    outwards = (normal * x)[..., :2].sum(-1) / r  # e_r . n dA
    box = [middle([r]), middle([z])]  # (middle, half width) in r and z
    # int f dV = closed integral of (int f rho drho) e_r . n dA / r, from the box's middle outwards
    rho = box[0][0] + (r - box[0][0])[..., None] * ACROSS
    weights = (2 * np.pi / STATIONS_ROUND * outwards * (r - box[0][0]) / r)[..., None]
    weights = weights * ACROSS_WEIGHTS * rho
    psi, slopes = monomials(rho, z[..., None] + 0 * rho, box)
    k = np.arange(1, WAVES_ROUND + 1)
    kphi = k * phi[..., None]
    T = np.concatenate([np.ones((*phi.shape, 1)), np.cos(kphi), np.sin(kphi)], -1)
    dT = np.concatenate([np.zeros((*phi.shape, 1)), -k * np.sin(kphi), k * np.cos(kphi)], -1)
    Q = _integral(weights, psi, T)
    H = sum(_integral(weights, slopes[..., i], T) for i in (0, 1))
    H = H + _integral(weights / rho**2, psi, dT)
    values, P = eigh(H / air.density, Q / air.bulk, subset_by_index=[1, 2])  # 0: no sound
    even = abs(P.reshape(len(T[0, 0]), -1, 2)[1, 0])  # of cos phi, the constant over the section
    hertz = np.sqrt(values) / (2 * np.pi)
    return np.asarray(hertz[np.argsort(even)])


def _wall(X: Array, connectivity: Array, U: Array, U_around: Array) -> tuple[Array, Array]:
    """Places x (s, p, 3) of the wall in the frame of the stations, and n dA / dTheta there,
    n out of the air; U (s, n, 3), U_around: its derivative by the angle."""
    lines = elements.lines(X, connectivity, POINTS_ALONG)
    at = lambda rows, u: np.einsum("ega,seai->segi", rows, u[:, connectivity])
    N = np.broadcast_to(lines.N, lines.slope.shape)
    rest = np.insert(X, 1, 0.0, 1)
    x, dx = at(N, U + rest), at(lines.slope, U + rest)
    normal = cross(dx, at(N, U_around) + x @ SPIN_AXIS.T) * lines.weights[..., None]
    return x.reshape(len(U), -1, 3), normal.reshape(len(U), -1, 3)


def _integral(weights: Array, psi: Array, T: Array) -> Array:
    """int (T_k psi_m) (T_l psi_n) dV, rows (k, m), columns (l, n); weights (s, p, g), psi
    (s, p, g, m), T (s, p, k)."""
    s, p, _, m = psi.shape
    across = (weights[..., None] * psi).swapaxes(-1, -2) @ psi
    around = T[..., :, None] * T[..., None, :]
    count = T.shape[-1]
    total = around.reshape(s * p, -1).T @ across.reshape(s * p, -1)
    shaped = total.reshape(count, count, m, m).transpose(0, 2, 1, 3)
    return np.asarray(shaped.reshape(count * m, -1))
