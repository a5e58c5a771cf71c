"""A section from two curves, the outer and the inner surface, and where carcass and belts lie."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..number_table import read_named_table
from .curve import length_along
from .section import Section, SectionError

Array = np.ndarray
STATIONS = {"crown": 16, "shoulder": 4, "upper_sidewall": 16, "lower_sidewall": 16, "bead": 4}
"""Intervals between stations by region; the shoulder lies between the two belts' edges."""
LINE_NAMES = ("inner", "ply", "belt1", "belt2", "outer")
DENSE = 600  # points of a curve between which it is straight
HELD = 0.15  # of the inner curve, at its end, where the rays turn to join the curves' ends


def read_outline(path: Path) -> dict[str, Array]:
    """The two curves (point, 2), r and z in m, from the crown's centre to the bead.

    Columns: curve (outer or inner), r_mm, z_mm; half a section, z at least 0, in either order.
    Raises SectionError, OSError.
    """
    curves: dict[str, list[list[float]]] = {"outer": [], "inner": []}
    table = read_named_table(path)
    for column in ("curve", "r_mm", "z_mm"):
        if column not in table.headings:
            raise SectionError(f"column '{column}' is missing", 1)
    for row in table.rows:
        curve = row.cells["curve"]
        if curve not in curves:
            raise SectionError(f"curve is '{curve}', must be outer or inner", row.line)
        r, z = row.millimetres("r_mm"), row.millimetres("z_mm")
        if not (r > 0 and z >= 0):
            raise SectionError(
                "r_mm must be greater than 0 and z_mm at least 0, as in half a section", row.line
            )
        curves[curve].append([r, z])
    return {name: _from_crown(name, np.array(points)) for name, points in curves.items()}


def _from_crown(name: str, points: Array) -> Array:
    """A curve (n, 2), r and z in m, its first point on the centre plane; points in mm. Raises
    SectionError."""
    if len(points) < 5:
        raise SectionError(f"the {name} curve has {len(points)} points, at least 5 are needed")
    points = points[:: -1 if points[-1, 1] < points[0, 1] and points[-1, 0] > points[0, 0] else 1]
    if points[0, 1] > 1e-6:
        raise SectionError(f"the {name} curve must begin at the crown's centre, z = 0")
    if not (np.hypot(*np.diff(points, axis=0).T) > 0).all():
        raise SectionError(f"the {name} curve has a point twice")
    return points * 1e-3


def section_of_outline(
    curves: dict[str, Array],
    belt_width: float,
    rim_radius: float,
    carcass_depth: float,
    belt_depth: float,
    belt_spacing: float,
    belt_step: float,
) -> Section:
    """The section between the ``inner`` and the ``outer`` curve, as `read_outline` has them, in m.

    belt_width: of the first, wider belt along the carcass; the second is ``belt_step`` narrower;
    rim_radius: the rim holds what lies nearer to the axle; carcass_depth: inner surface to
    carcass; belt_depth, belt_spacing: carcass to first belt, first to second. Raises SectionError.
    """
    inner, tangent = _smooth(curves["inner"])
    outer, _ = _smooth(curves["outer"])
    rays = _rays(inner, tangent, outer[-1] - inner[-1])
    thickness = _thickness(inner, rays, outer)
    depth = np.minimum(carcass_depth, 0.4 * thickness)  # less where the tyre is thin
    carcass = inner + depth[:, None] * rays
    arc = length_along(carcass)
    widest = int(np.argmax(carcass[:, 1]))
    below = np.flatnonzero(carcass[:, 0] < rim_radius)
    edge = belt_width / 2
    if not len(below) or not widest < below[0] < len(arc) - 1:
        raise SectionError(
            f"the rim holds the tyre below r = {1e3 * rim_radius:.1f} mm: this must be between"
            f" the bead, at {1e3 * carcass[-1, 0]:.1f} mm, and the widest point,"
            f" at {1e3 * carcass[widest, 0]:.1f} mm"
        )
    if not belt_step / 2 < edge < arc[widest]:
        raise SectionError(
            f"the belt must be between {1e3 * belt_step:.1f} and {2e3 * arc[widest]:.1f} mm wide,"
            f" got {1e3 * belt_width:.1f}"
        )
    rim = float(
        np.interp(
            rim_radius,
            carcass[below[0] - 1 : below[0] + 1][::-1, 0],
            arc[below[0] - 1 : below[0] + 1][::-1],
        )
    )
    ends = [0.0, edge - belt_step / 2, edge, arc[widest], rim, arc[-1]]
    parts = zip(STATIONS.values(), ends, ends[1:], strict=False)
    s = np.concatenate([[0.0], *(np.linspace(a, b, n + 1)[1:] for n, a, b in parts)])
    distances = np.stack(
        [
            np.zeros_like(arc),
            depth,
            depth + belt_depth,
            depth + belt_depth + belt_spacing,
            thickness,
        ]
    )
    if (distances[3] >= thickness)[arc <= edge].any():
        raise SectionError("the belts are not inside the tyre: it is thinner than their depth")
    lines = inner + distances[..., None] * rays
    points = np.stack([np.stack([np.interp(s, arc, x) for x in line.T], -1) for line in lines])
    points[2, s > edge + 1e-9] = points[3, s > edge - belt_step / 2 + 1e-9] = np.nan
    drawn = curves["outer"], curves["inner"]
    return Section(LINE_NAMES, points, tuple(STATIONS.items()), s >= rim - 1e-9, drawn)


def _smooth(curve: Array) -> tuple[Array, Array]:
    """Points (n, 2) and unit tangents (n, 2) at equal steps of the curve's length, n = `DENSE`,
    without new bumps."""
    arc = length_along(curve)
    through = PchipInterpolator(arc, curve)
    at = np.linspace(0, arc[-1], DENSE)
    tangent = through(at, 1)
    return through(at), tangent / np.hypot(*tangent.T)[:, None]


def _rays(inner: Array, tangent: Array, last: Array) -> Array:
    """Unit directions (n, 2) through the thickness: upright at the crown, along the normal, and at
    the bead from the end of one curve to that of the other."""
    rays = np.stack([tangent[:, 1], -tangent[:, 0]], -1)
    rays[0] = [1.0, 0.0]
    share = np.clip((np.linspace(0, 1, len(inner)) - 1 + HELD) / HELD, 0, 1)[:, None]
    rays = (1 - share) * rays + share * last / np.hypot(*last)
    unit: Array = rays / np.hypot(*rays.T)[:, None]
    return unit


def _thickness(start: Array, rays: Array, outer: Array) -> Array:
    """Length (n,), m, of each ray from the inner surface to the outer, by the nearest crossing.
    Raises SectionError for a ray without one."""
    a, side = outer[:-1], np.diff(outer, axis=0)  # start + length ray = a + along side
    turn = rays[:, None, 0] * side[None, :, 1] - rays[:, None, 1] * side[None, :, 0]
    gap = a[None] - start[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        length = (gap[..., 0] * side[None, :, 1] - gap[..., 1] * side[None, :, 0]) / turn
        along = (gap[..., 0] * rays[:, None, 1] - gap[..., 1] * rays[:, None, 0]) / turn
    hit = (length > 0) & (along >= -1e-9) & (along <= 1 + 1e-9)
    nearest: Array = np.where(hit, length, np.inf).min(1)
    missed = np.flatnonzero(~np.isfinite(nearest))
    if len(missed):
        r, z = 1e3 * start[missed[0]]
        raise SectionError(
            f"no outer surface is opposite the inner one at r = {r:.1f} mm, z = {z:.1f} mm"
        )
    return nearest
