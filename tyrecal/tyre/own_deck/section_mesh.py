"""A deck's section as all else sees it: its mesh, and its half drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..section.curve import length_along
from ..section.mesh import SectionMesh
from ..section.section import Section
from .scope import CORNERS_OF
from .solver_deck import RebarPly, SolverDeck

Array = np.ndarray
DRAWN_STATIONS = 40  # of the drawn half


@dataclass(eq=False, kw_only=True)
class OwnDeckMesh(SectionMesh):
    """A mesh of any arrangement; regions are its rubbers, lines the sets of its plies."""

    deck: SolverDeck

    @property
    def inner_ends(self) -> tuple[int, int]:
        """First and last node of the inner surface."""
        return self.deck.mesh.inner[0], self.deck.mesh.inner[-1]

    @property
    def outer_nodes(self) -> list[int]:
        """Nodes of the outer surface from -z to +z, midside ones too."""
        return list(self.deck.mesh.outer)

    def grid(self) -> tuple[Array, Array]:
        """Corner nodes, and the places (element, 4) of each element's among them; the third corner
        of a triangle twice."""
        quads = [(*nodes[:c], *[nodes[2]] * (4 - c)) for nodes, c in self._corners()]
        nodes, places = np.unique(np.array(quads), return_inverse=True)
        return nodes, places.reshape(-1, 4)

    def skin(self) -> Array:
        """Corner nodes (k,) of the outer surface from -z to +z."""
        corners = {n for nodes, c in self._corners() for n in nodes[:c]}
        return np.array([n for n in self.deck.mesh.outer if n in corners])

    @property
    def angles(self) -> dict[str, float]:
        """Angles of the layers by name, degrees from the meridian."""
        return {name: ply.angle_deg for name, ply in self._named().items()}

    @property
    def layers(self) -> dict[str, list[tuple[int, ...]]]:
        """Nodes of the elements to draw each layer with: layers of one set take turns."""
        result = {}
        for name, ply in self._named().items():
            sharing = [other for other in self.deck.plies if other.set_name == ply.set_name]
            elements = list(self.cords[ply.set_name].values())
            result[name] = elements[sharing.index(ply) :: len(sharing)]
        return result

    @property
    def compounds(self) -> dict[str, list[tuple[int, ...]]]:
        """Corner nodes of the elements of each."""
        by_material: dict[str, list[tuple[int, ...]]] = {}
        for number, (material, _) in self.cells.items():
            nodes = self.solids[number]
            by_material.setdefault(material, []).append(nodes[: CORNERS_OF[len(nodes)]])
        return by_material

    @property
    def lines_by_cord(self) -> dict[str, list[tuple[int, ...]]]:
        """Nodes of the elements of its layers, by their material."""
        by_material: dict[str, list[tuple[int, ...]]] = {}
        for ply in self.deck.plies:
            by_material.setdefault(ply.material, []).extend(self.cords[ply.set_name].values())
        return by_material

    def _named(self) -> dict[str, RebarPly]:
        """Plies by name, by set and name where several have one name."""
        names = [ply.name for ply in self.deck.plies]
        return {
            ply.name if names.count(ply.name) == 1 else f"{ply.set_name} {ply.name}": ply
            for ply in self.deck.plies
        }

    def _corners(self) -> list[tuple[tuple[int, ...], int]]:
        return [(nodes, CORNERS_OF[len(nodes)]) for nodes in self.solids.values()]

    def outline(self) -> list[int]:
        """Nodes round the section, closed, from the inner surface's first."""
        return list(self.deck.mesh.around)


def section_mesh(flat: SolverDeck) -> OwnDeckMesh:
    """The mesh of a flat deck."""
    mesh = flat.mesh
    number = {name: k for k, name in enumerate(dict.fromkeys(flat.materials))}
    return OwnDeckMesh(
        quadratic=any(len(nodes) in (6, 8) for nodes in mesh.solids.values()),
        nodes=mesh.nodes,
        solids=mesh.solids,
        cells={
            n: (flat.materials[k], number[flat.materials[k]]) for n, k in mesh.section_of.items()
        },
        cords={ply.set_name: {n: mesh.plies[n] for n in ply.elements} for ply in flat.plies},
        rim=list(mesh.rim),
        inner=[face[0] for face in mesh.cavity],
        outer=[face[0] for face in mesh.tread],
        shape=(len(mesh.solids), 1),
        crown_outer=list(mesh.crown),
        deck=flat,
    )


def section(flat: SolverDeck) -> Section:
    """The half of positive z, of its inner and its outer surface; each rubber's name is that of a
    region over all of it, and held is what is no further from the axle than the rim's nodes."""
    mesh = flat.mesh
    lines = []
    for path in (mesh.inner, mesh.outer):
        points = np.array([mesh.nodes[n] for n in path])
        half = points[points[:, 1] >= 0]
        arc = length_along(half)
        at = np.linspace(0.0, arc[-1], DRAWN_STATIONS)
        lines.append(np.column_stack([np.interp(at, arc, x) for x in half.T]))
    rim = np.array([mesh.nodes[n] for n in mesh.rim])
    rigid = lines[1][:, 0] <= rim[:, 0].max()
    regions = tuple((name, DRAWN_STATIONS - 1) for name in dict.fromkeys(flat.materials))
    return Section(("inner", "outer"), np.array(lines), regions, rigid)
