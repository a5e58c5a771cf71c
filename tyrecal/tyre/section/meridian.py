"""The carcass of an inflated radial tyre: where its meridian runs from the crown to the rim.

A net of meridional cords under pressure p has the curvature kappa = r p (1 - g) / T, with T the
cords' tension a radian round the axle and g the share of the pressure that the belt carries. With
the arc s and the angle psi of the meridian from the axle's direction,

    d psi / ds = (r / rho) (1 - g(s)),   dr/ds = -sin psi,   dz/ds = cos psi

from the crown's centre (psi = 0) outwards, rho = T / p. The belt, of half width b, carries

    g(s) = g0 (1 - (s/b)^n),   g0 = 1 - rho / (r0 R)      r0, R: its r and its radius of
                                                          curvature at the crown

(a choice: any share that fades towards the edge would do) and nothing beyond, where
cos psi = cos psi_b + (r^2 - r_b^2) / (2 rho). rho and n follow from the widest point. Below it,
where the bead's filler bends more than it yields, a cubic of the same curvature leads to the rim.

Hofferberth, Zur Festigkeit des Luftreifens, Kautschuk und Gummi 9 (1956) 225; Koutny, Geometry and
Mechanics of Pneumatic Tires (Zlin 2007), 4.3.2 and 4.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from .curve import CubicSpline, length_along
from .section import SectionError

Array = np.ndarray
STEPS_A_PART = 200  # under the belt, and above and below the widest point
EXPONENTS = np.log([1.0, 40.0])  # ln n of the belt's share: from a roof to nearly a step
MAX_RIM_SLOPE = np.tan(np.radians(75))  # of the carcass at the rim, from the wheel's plane
# of the carcass at the seat: its curvature times the gauge outside it, which would fold at 1
SHARPEST_TURN = 0.6


@dataclass(frozen=True)
class Meridian:
    """A carcass line from the crown to the bead, all in m."""

    arc: Array  # (k,) arc length of each of its points from the crown
    points: Array  # (k, 2) r and z
    widest: float  # arc length to the widest point
    rim: float  # arc length to where the rim holds the tyre
    end: float  # arc length to the end

    def at(self, s: Array) -> Array:
        """Points (k, 2), r and z in m, at arcs s (k,)."""
        return CubicSpline(self.arc, self.points, start=np.array([0.0, 1.0]))(s)  # along the axle


def meridian(
    crown: float,
    crown_radius: float,
    belt: float,
    widest: tuple[float, float],
    rim: tuple[float, float],
    seat: float,
    offset: float,
) -> Meridian:
    """The carcass from the crown (at r = ``crown``, curved with ``crown_radius``) to the bead.

    belt: half width b of the belt; widest: (r, z) of the carcass there; rim: (r, z) of the top of
    the flange, which the surface ``offset`` outside the carcass touches; seat: radius of the
    carcass' end. All in m. The radius of the widest point is met as nearly as n between 1 and 40
    allows. Raises SectionError where no carcass runs so.
    """
    upper, rho = _upper(crown, crown_radius, belt, *widest)
    curvature = upper[-1, 0] / rho
    lean = 0.0  # angle of the carcass at the rim from the wheel's plane
    height = max(upper[-1, 0] - rim[0], 1e-3)
    for _ in range(20):  # the normal of the carcass at the rim leans with it
        z = rim[1] - offset * np.cos(lean)
        cubic = (z - widest[1] + curvature / 2 * height**2) / height**3
        lean = np.arctan(curvature * height - 3 * cubic * height**2)
    if z > widest[1] or height < offset:
        raise SectionError(f"a rim {2e3 * rim[1]:.0f} mm wide leaves the tyre no sidewall")
    if abs(np.tan(lean)) > MAX_RIM_SLOPE:
        raise SectionError(f"a rim {2e3 * rim[1]:.0f} mm wide is too narrow for the tyre")
    x = np.linspace(0, height, STEPS_A_PART + 1)[1:]
    lower = np.stack([upper[-1, 0] - x, widest[1] - curvature / 2 * x**2 + cubic * x**3], -1)
    # held by the rim: it turns upright, down to the seat, as far as the surface outside allows
    upright = max(0.0, lean - SHARPEST_TURN * (rim[0] - seat) / offset)
    turn = np.linspace(lean, upright, STEPS_A_PART // 4 + 1)[1:]
    down = (rim[0] - seat) * np.linspace(0, 1, STEPS_A_PART // 4 + 1)[1:]
    steps = np.diff(down, prepend=0.0)
    held = np.stack([rim[0] - down, z - np.cumsum(np.tan(turn) * steps)], -1)
    points = np.concatenate([upper, lower, held])
    arc = length_along(points)
    ends = np.cumsum([len(upper), len(lower), len(held)]) - 1
    return Meridian(arc, points, *(float(arc[i]) for i in ends))


def _upper(
    crown: float, crown_radius: float, belt: float, radius: float, width: float
) -> tuple[Array, float]:
    """Points (k, 2), m, from the crown to the widest one at z = ``width``, near r = ``radius``;
    and rho, m2."""

    def log_rho_of(log_n: float) -> float:
        """ln rho with which the tyre is as wide as it should be."""
        # r0 times radii of curvature
        logs = np.log(crown * np.geomspace(width / 20, crown_radius, 30))
        miss = [_widest(crown, crown_radius, belt, x, log_n)[1] - width for x in logs]
        change = [i for i in range(len(miss) - 1) if miss[i] < 0 <= miss[i + 1]]
        if not change:
            raise SectionError(
                f"no sidewall runs from a belt {2e3 * belt:.0f} mm wide to a section"
                f" {2e3 * width:.0f} mm wide at the carcass"
            )
        a, b = logs[change[-1]], logs[change[-1] + 1]
        wide = lambda x: _widest(crown, crown_radius, belt, x, log_n)[1] - width
        return float(brentq(wide, a, b, xtol=1e-13))

    def high(log_n: float) -> float:
        """Radius of the widest point less the wanted one, m."""
        return _widest(crown, crown_radius, belt, log_rho_of(log_n), log_n)[0] - radius

    low, top = EXPONENTS
    if high(low) > 0:
        log_n = low
    elif high(top) < 0:
        log_n = top
    else:
        log_n = float(brentq(high, low, top, xtol=1e-9))
    log_rho = log_rho_of(log_n)
    rho = float(np.exp(log_rho))
    under = _belt(crown, crown_radius, belt, rho, np.exp(log_n))
    return np.concatenate([under[:, :2], _beyond(under[-1], rho)[1:]]), rho


def _widest(
    crown: float, crown_radius: float, belt: float, log_rho: float, log_n: float
) -> tuple[float, float]:
    """(r, z) of the widest point; z = 0 where the carcass turns inwards under the belt already."""
    rho = np.exp(log_rho)
    edge = _belt(crown, crown_radius, belt, rho, np.exp(log_n))[-1]
    if edge[2] >= np.pi / 2:
        return 0.0, 0.0
    if edge[2] < 0 or edge[0] ** 2 < 2 * rho * np.cos(edge[2]):  # so flat that it has none
        return 0.0, np.inf
    r, z = _beyond(edge, rho)[-1]
    return float(r), float(z)


def _belt(crown: float, crown_radius: float, belt: float, rho: float, n: float) -> Array:
    """r, z and psi at points under the belt, (k, 3)."""
    s = np.linspace(0, belt, STEPS_A_PART + 1)
    left = 1 - (1 - rho / (crown * crown_radius)) * (1 - (s / belt) ** n)  # 1 - g
    r = np.full(len(s), crown)
    for _ in range(6):  # r hardly moves, and with it the curvature
        psi = _integral(r / rho * left, s)
        r = crown - _integral(np.sin(psi), s)
    return np.stack([r, _integral(np.cos(psi), s), psi], -1)


def _beyond(edge: Array, rho: float) -> Array:
    """Points (k, 2) from the belt's ``edge`` (r, z, psi) to the widest one, at equal steps of psi:
    dz/dpsi = cos psi / kappa = rho cos psi / r."""
    r_b, z_b, psi_b = edge
    psi = np.linspace(psi_b, np.pi / 2, STEPS_A_PART + 1)
    r = np.sqrt(r_b**2 + 2 * rho * (np.cos(psi) - np.cos(psi_b)))
    return np.stack([r, z_b + _integral(rho * np.cos(psi) / r, psi)], -1)


def _integral(f: Array, x: Array) -> Array:
    """Integral of f (k,) over x from the first point to each (k,), by trapezia."""
    return np.concatenate([[0.0], np.cumsum((f[1:] + f[:-1]) / 2 * np.diff(x))])
