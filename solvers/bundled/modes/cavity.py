"""The air in the tyre's cavity as an acoustic medium, per circumferential harmonic.

Its pressure is p = sum_k P_k psi_k(r, z) exp(i n theta), psi_k monomials of (r, z) up to the degree
MONOMIAL_DEGREE: exact for plane waves round a thin torus and for air that a rigid wheel carries
along; for the flow across the section, whose own waves are above 700 Hz, right to 3e-5 of the
tyre's frequencies (`tests/bundled/test_cavity.py`). Weakly,

    Q P'' + H P = -C u'',    Q = 1/B int psi psi dV,  H = 1/rho int grad psi . grad psi dV,
                             C u = int psi u . n dA   (volume that the wall sweeps, weighted)

': d/dt; n of n dA: unit normal out of the air; rho, B: the air's density and bulk modulus (Morand
and Ohayon, Fluid Structure Interaction, ch. 8). With w'' = P = -Q^-1 (C u + H w) it is symmetric:

    stiffness  (C u + H w)^T Q^-1 (C u + H w),   mass  w^T H w

where w leaves out the constant at n = 0, which has no flow but a stiffness: the whole volume's,
B dV / V. The twist of the inflated section is left out of exp(i n theta).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...language.text import WHOLE_DECK, Block, DeckError
from ..deck.request import CavityRequest
from ..section import elements
from ..section.elements import Lines
from ..section.materials import Scalar, read_materials
from ..section.mesh import DeckMesh
from ..section.parts.part import SPIN_AXIS, cross
from ..section.parts.pressure import surface_point

Array = np.ndarray
MONOMIAL_DEGREE = 4  # of the pressure terms in R and Z
POINTS_ALONG = 6  # points of a line of the wall; the well is one line
GAUSS = np.polynomial.legendre.leggauss(7)  # from the section's middle radius to the wall
ACROSS, ACROSS_WEIGHTS = (GAUSS[0] + 1) / 2, GAUSS[1] / 2


@dataclass(frozen=True)
class GasCavity:
    """Density (kg/m3) and bulk modulus (Pa) of the air inside the closed ``surfaces``."""

    density: Scalar
    bulk: Scalar
    surfaces: list[Lines]


def read_cavity(keywords: list[Block], mesh: DeckMesh, cavity: CavityRequest) -> GasCavity:
    """The gas of a request. Raises DeckError."""
    name = cavity.material.upper()
    material = read_materials(keywords).get(name)
    surfaces = [surface.upper() for surface in cavity.surfaces]
    if material is None or material.bulk_modulus is None or not np.real(material.density) > 0:
        raise DeckError(
            WHOLE_DECK, f"the cavity's material '{name}' has no *ACOUSTIC MEDIUM and *DENSITY"
        )
    missing = [surface for surface in surfaces if surface not in mesh.faces]
    if missing:
        raise DeckError(WHOLE_DECK, f"the cavity needs surfaces that are defined, got {missing}")
    return GasCavity(material.density, material.bulk_modulus, [mesh.faces[s] for s in surfaces])


@dataclass(frozen=True)
class GasCoupling:
    """Matrices of a harmonic, per radian, on the k terms of the pressure."""

    C: Array  # (k, nodes, 3), m2
    H: Array  # (k, k), m4/kg
    Q: Array  # (k, k), m3/Pa
    flowing: slice  # columns of H that w, kg/m, has

    def strain(self, u: Array, w: Array) -> Array:
        """C u + H w for u (nodes, 3) and w, real or of a complex step."""
        return np.tensordot(self.C, u, 2) + self.H[:, self.flowing] @ w

    def flow(self, u: Array, eigenvalue: float) -> Array:
        """w of a mode from its u (nodes, 3) and its eigenvalue lambda: (H^T Q^-1 H - lambda H) w =
        -H^T Q^-1 C u. The strain of w and u is a small difference, which an iteration does not find
        to many digits."""
        flow = self.H[:, self.flowing]
        stiff = np.linalg.solve(self.Q, flow).T
        own = stiff @ flow - eigenvalue * flow[self.flowing]
        amplitudes: Array = np.linalg.solve(own, -stiff @ np.tensordot(self.C, u, 2))
        return amplitudes


def coupling(air: GasCavity, X: Array, U: Array, n: int) -> GasCoupling:
    """Matrices of the inflated cavity in harmonic n. X (nodes, 2), U (nodes, 3); complex steps
    allowed."""
    kind = np.result_type(X, U)
    walls = [elements.lines(X, surface.connectivity, POINTS_ALONG) for surface in air.surfaces]
    wall = [(lines, *surface_point(lines, U)) for lines in walls]
    radii = [np.sqrt(x[..., 0] ** 2 + x[..., 1] ** 2) for _, x, _ in wall]
    box = [middle(radii), middle([x[..., 2] for _, x, _ in wall])]
    centre = box[0][0]
    C: Array = np.zeros((_count(), *U.shape), kind)
    Q = np.zeros((_count(), _count()), kind)
    H = np.zeros_like(Q)
    for (lines, x, dx), r in zip(wall, radii, strict=True):
        z, dz = x[..., 2], dx[..., 2]
        psi, _ = monomials(r, z, box)
        swept = cross(dx, x @ SPIN_AXIS.T) * lines.weights[..., None]  # n dA
        parts = np.einsum("egk,egi,ga->keai", psi, swept, lines.N)
        for k, part in enumerate(parts):
            np.add.at(C[k], lines.connectivity, part)
        # int f dr dz = -closed line integral of (int f dr) dz, from the centre outwards
        rho = centre + (r - centre)[..., None] * ACROSS
        weights = -((r - centre) * dz * lines.weights)[..., None] * ACROSS_WEIGHTS * rho
        psi, slopes = monomials(rho, z[..., None] + 0 * rho, box)
        Q += _integral(weights, psi)
        H += _integral(weights, slopes[..., 0]) + _integral(weights, slopes[..., 1])
        H += _integral(n * n * weights / rho**2, psi)
    return GasCoupling(C, H / air.density, Q / air.bulk, slice(0 if n else 1, None))


def _integral(weights: Array, f: Array) -> Array:
    """sum over points of weights (...) times f_k f_l (k, k); f (..., k)."""
    flat = f.reshape(weights.size, -1)
    return np.asarray((weights.reshape(-1, 1) * flat).T @ flat)


def _count() -> int:
    return (MONOMIAL_DEGREE + 1) * (MONOMIAL_DEGREE + 2) // 2


def middle(values: list[Array]) -> tuple[float, float]:
    """Middle and half width of a range."""
    low = min(float(v.real.min()) for v in values)
    high = max(float(v.real.max()) for v in values)
    return (low + high) / 2, (high - low) / 2


def monomials(r: Array, z: Array, box: list[tuple[float, float]]) -> tuple[Array, Array]:
    """Values (..., k) and slopes (..., k, 2) of x^i y^j, the constant first; x and y from -1 to 1
    over the section's ``box``, middle and half width in r and in z."""
    x, y = ((p - middle) / half for p, (middle, half) in zip((r, z), box, strict=True))
    powers = [(d - j, j) for d in range(MONOMIAL_DEGREE + 1) for j in range(d + 1)]
    values = np.stack([x**i * y**j for i, j in powers], -1)
    by_x = np.stack([i * x ** max(i - 1, 0) * y**j for i, j in powers], -1)
    by_y = np.stack([j * x**i * y ** max(j - 1, 0) for i, j in powers], -1)
    return values, np.stack([by_x / box[0][1], by_y / box[1][1]], -1)
