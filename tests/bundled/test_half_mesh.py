"""Choice of the half of a mesh that represents the whole, and meshes that have none."""

from __future__ import annotations

import numpy as np
import pytest
from tyrecal_solvers.bundled.section.half_mesh import half_mesh
from tyrecal_solvers.bundled.section.mesh import DeckMesh
from tyrecal_solvers.bundled.section.symmetry import MirrorHalf
from tyrecal_solvers.errors import Refused

LINES = [[0, 1], [1, 2], [3, 4]]  # two to either side of the middle node, one across


def strip(*sets: tuple[str, list[int]]) -> DeckMesh:
    """Line elements 1, 2, ... of nodes at z = -1, 0, 1, then -2, 2."""
    X = np.array([[1.0, -1.0], [1.0, 0.0], [1.0, 1.0], [1.0, -2.0], [1.0, 2.0]])
    rows = np.array(LINES)
    place = {i + 1: ("SFMGAX1", i) for i in range(len(rows))}
    edges = {name: rows[[e - 1 for e in numbers]] for name, numbers in sets}
    index = {i: i for i in range(len(X))}
    return DeckMesh(X, index, {"SFMGAX1": rows}, place, {}, dict(sets), edges, {})


def test_sets_and_surfaces_that_are_their_own_images() -> None:
    """Half of a set represents the whole, and parts across the middle count by half."""
    sets = [("BOTH", [1, 2]), ("ONE", [1]), ("ACROSS", [3]), ("ALL", [3, 2, 1]), ("TWO", [1, 1])]
    half = half_mesh(strip(*sets))
    assert half is not None and half.connectivity["SFMGAX1"].tolist() == [[1, 2], [3, 4]]
    assert half.element_sets == {"BOTH": [2], "ACROSS": [3], "ALL": [3, 2]}
    assert half.place == {2: ("SFMGAX1", 0), 3: ("SFMGAX1", 1)}
    assert {k: v.tolist() for k, v in half.edges.items()} == {
        "BOTH": [[1, 2]],
        "ACROSS": [[3, 4]],
        "ALL": [[3, 4], [1, 2]],
    }
    assert half.symmetry.share(half.connectivity["SFMGAX1"]).tolist() == [[1.0], [0.5]]
    assert half.blocks["SFMGAX1"].weights.sum(1) == pytest.approx([1.0, 2.0])


def test_cords_are_turned_by_half_a_turn_not_mirrored() -> None:
    """A line from z = 1 to 0 has its angle counted the other way round than one from -1 to 0."""
    mesh = strip(("BOTH", [1, 2]))
    mesh.connectivity["SFMGAX1"] = np.array([[0, 1], [2, 1], [3, 4]])
    half = half_mesh(mesh)
    assert half is not None and not half.element_sets


@pytest.mark.parametrize("X", [[[1.0, 0.1], [1.0, -0.2]], [[1.0, 0.1], [1.0, -0.1 - 1e-9]]])
def test_nodes_without_a_mirror_image(X: list[list[float]]) -> None:
    with pytest.raises(Refused):
        MirrorHalf(np.array(X))


def test_two_nodes_in_one_place_have_no_image_of_their_own() -> None:
    with pytest.raises(Refused):
        MirrorHalf(np.array([[1.0, 0.1], [1.0, -0.1], [1.0, -0.1]]))
