"""Names for templates of what sits at one place of the tread, and of a tyre that turns."""

from __future__ import annotations

from typing import Any

from ...tyre.case import Case
from ...tyre.section.mesh import SectionMesh

FIRST_ATTACHED_ELEMENT = 999_100_001  # beyond all that a revolve makes
AXES = {"radial": 1, "lateral": 2, "tangential": 3}  # of the revolved tyre in the plane Theta = 0


def attached(c: Case, mesh: SectionMesh) -> list[dict[str, Any]]:
    """Mass and spring elements on nodes of the tread: name, keyword, elements, lines of data."""
    groups: list[tuple[str, str, list[int], tuple[int, float] | None]] = []
    number = FIRST_ATTACHED_ELEMENT
    if c.point_mass.mass_kg:
        groups.append(("POINT_MASS", "MASS", _nodes(mesh, c.point_mass.z_m, 0.0), None))
    for direction, stiffness in c.road_spring.stiffnesses.items():
        nodes = _nodes(mesh, 0.0, c.road_spring.width_m)
        groups.append((f"ROAD_{direction.upper()}", "SPRING", nodes, (AXES[direction], stiffness)))
    result = []
    for name, keyword, nodes, spring in groups:
        result.append(
            {
                "name": name,
                "keyword": keyword,
                "type": "SPRING1" if spring else "MASS",
                "elements": [(number + i, node) for i, node in enumerate(nodes)],
                "dof": spring[0] if spring else None,
                "value": spring[1] / len(nodes) if spring else c.point_mass.mass_kg,
            }
        )
        number += len(nodes)
    return result


def turning(c: Case, sets: list[str]) -> dict[str, Any] | None:
    """Speed of a tyre that turns, rad/s, and the element sets that hold its mass."""
    if not c.spin_rad_per_s:
        return None
    return {"omega": c.spin_rad_per_s, "omega2": c.spin_rad_per_s**2, "sets": sets}


def _nodes(mesh: SectionMesh, z: float, width: float) -> list[int]:
    """Nodes of the tread within half a width of a height; the nearest one at least."""
    away = {node: abs(mesh.nodes[node][1] - z) for node in mesh.crown_outer}
    nearest = min(away, key=lambda node: (away[node], node))
    return [node for node in away if away[node] <= width / 2 or node == nearest]
