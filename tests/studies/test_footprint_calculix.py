"""Computations of the comparison of footprints with CalculiX."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ..solvers.press_deck import Angles, press_texts
from ..solvers.test_press_deck import coarse_case
from .footprint_calculix import extrapolated
from .tread_gap import area_of_gap, serendipity, tread_faces

HALF = Angles(8.0, 24.0, 20.0, 1.5)


@pytest.mark.parametrize("step", [0.010, 0.005])
def test_the_gap_tells_the_edge(step: float) -> None:
    """An ellipse of 0.09 by 0.05 m, beside which the gap opens as distance^(3/2)."""
    a, b = 0.09, 0.05
    along, across = np.meshgrid(np.arange(0, 0.15, step), np.arange(0, 0.09, step), indexing="ij")
    outside = b * (np.hypot(along / a, across / b) - 1)
    over = np.where(outside <= 0, 3e-5, -(np.maximum(outside, 0) ** 1.5))
    assert area_of_gap(along, across, over) == pytest.approx(np.pi * a * b, rel=0.02)


def test_extrapolation_finds_the_limit_of_its_own_law() -> None:
    sizes = [8.0, 6.0, 4.0]
    assert extrapolated(sizes, [5 + 0.1 * h**2 for h in sizes]) == pytest.approx((5.0, 0.0))
    assert extrapolated([8.0, 6.0], [5 + 6.4, 5 + 3.6]) == pytest.approx((5.0, 3.6))


def test_functions_of_a_face() -> None:
    """The functions are one at their own node; they and their derivatives carry a linear field."""
    a = np.array([-1.0, 1, 1, -1, 0, 1, 0, -1])
    b = np.array([-1.0, -1, 1, 1, -1, 0, 1, 0])
    N, _, _ = serendipity(a, b)
    assert pytest.approx(np.eye(8)) == N
    N, by_a, by_b = serendipity(np.array([0.3, -0.7]), np.array([0.2, 0.9]))
    field = 2 + 3 * a - 5 * b
    assert N @ field == pytest.approx([2.0 + 0.9 - 1.0, 2 - 2.1 - 4.5])
    assert by_a @ field == pytest.approx([3, 3]) and by_b @ field == pytest.approx([-5, -5])


@pytest.mark.parametrize("element", ["C3D8", "C3D20"])
def test_faces_lie_on_the_tread(element: str, tmp_path: Path) -> None:
    texts = press_texts(coarse_case(element), [0.01], HALF, 0.3925)
    (tmp_path / "wheel.inp").write_text(texts["wheel.inp"])
    faces = tread_faces(tmp_path)
    assert {len(face) for face in faces} == {8 if element == "C3D20" else 4}
    rows = re.findall(r"^(\d+), (\S+), (\S+), (\S+)$", texts["wheel.inp"], re.M)
    place = {int(n): np.array([float(v) for v in xyz]) for n, *xyz in rows}
    for face in faces:
        p = np.array([place[n] for n in face])
        normal = np.cross(p[1] - p[0], p[2] - p[1])
        outwards = p[:4].mean(0) * [1, 1, 0]
        assert normal @ outwards > 0.1 * np.linalg.norm(normal) * np.linalg.norm(outwards)
        if element == "C3D20":
            assert p[4:] == pytest.approx((p[:4] + np.roll(p[:4], -1, 0)) / 2, abs=2e-3)
