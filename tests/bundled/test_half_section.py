"""Half of the section for the whole: the whole computation, which stays, is the judge.

Choice of the half of a mesh that represents the whole, and meshes that have none.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled import adapter
from tyrecal_solvers.bundled import job as jobs
from tyrecal_solvers.bundled.deck.request import CavityRequest, Request
from tyrecal_solvers.bundled.deck.steps import Deck, Tangent
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import lanczos
from tyrecal_solvers.bundled.results import StepResult
from tyrecal_solvers.bundled.section.half_mesh import half_mesh
from tyrecal_solvers.bundled.section.mesh import DeckMesh
from tyrecal_solvers.bundled.section.symmetry import HALF_TURN, MirrorHalf, mirror_images
from tyrecal_solvers.errors import Refused

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.values import with_values

from ..effects.support import CASE, decks

Array = np.ndarray
Edit = tuple[str, str]
# of frequencies: round-off, 1e-16 times the stiffest mode's lambda over the lowest, about 1e6
ROUND_OFF = 1e-9
HARMONICS = [0, 1, 2]


@cache
def texts(effects: tuple[tuple[str, float], ...]) -> dict[str, str]:
    """inflate and modes of the coarse tyre."""
    return pair(CASE, **dict(effects))


def pair(case: LoadedCase, **effects: float) -> dict[str, str]:
    written = decks(case, **effects)
    return {name: written[f"{name}.inp"] for name in ("inflate", "modes")}


def edited(effects: tuple[tuple[str, float], ...], *edits: Edit) -> dict[str, str]:
    """Decks of the coarse tyre in which what stands there is replaced once in each."""
    own = dict(texts(effects))
    for old, new in edits:
        assert any(old in text for text in own.values()), old
        own = {name: text.replace(old, new, 1) for name, text in own.items()}
    return own


def job(pair: dict[str, str], **request: Any) -> Job:
    settings = {"harmonics": HARMONICS, "modes_per_harmonic": 2, **request}
    return Job(Deck(pair, "modes", "inflate"), Request(**settings))


@pytest.fixture
def both(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[StepResult, StepResult]]:
    """Results of a pair of decks on half of the section and on the whole."""

    def run(pair: dict[str, str], **request: Any) -> tuple[StepResult, StepResult]:
        monkeypatch.setattr(lanczos, "INVERSE_RTOL", 1e-12)  # slopes are as good as shapes
        half = job(pair, **request)
        assert half.tyre.half
        with monkeypatch.context() as patch:
            patch.setattr(jobs, "keeps_half_turn", lambda *_: False)
            whole = job(pair, **request)
        assert not whole.tyre.half
        return half.run()[-1], whole.run()[-1]

    return run


def agree(half: StepResult, whole: StepResult, rtol: float = ROUND_OFF) -> None:
    """State, masses, modes and slopes."""
    np.testing.assert_allclose(half.U, whole.U, atol=1e-11 * abs(whole.U).max())
    assert half.mass_kg == pytest.approx(whole.mass_kg, rel=1e-12)
    for mine, its in zip(half.modes, whole.modes, strict=True):
        np.testing.assert_allclose(mine.eigenvalues, its.eigenvalues, rtol=2 * rtol)
        for u, v in zip(mine.shapes, its.shapes, strict=True):
            lengths = np.linalg.norm(u), np.linalg.norm(v)
            assert abs(np.vdot(u, v)) == pytest.approx(lengths[0] * lengths[1], rel=1e-9)
            assert lengths[0] == pytest.approx(lengths[1], rel=1e-7)
    for name, slopes in whole.rates.items():
        scale = max(abs(values).max() for values in slopes)
        for got, values in zip(half.rates[name], slopes, strict=True):
            np.testing.assert_allclose(got, values, atol=1e-7 * scale)


def below(pair: dict[str, str], line: str, *fields: int, tangent: float = 1.0) -> list[Tangent]:
    """A tangent on fields of the row under the first line that begins so."""
    lines = pair["inflate"].splitlines()
    place = next(i for i, text in enumerate(lines) if text.startswith(line))
    return [("inflate", place + 2, field, tangent) for field in fields]


def node(number: int) -> str:
    """The row of a node of the coarse tyre."""
    rows = texts(())["inflate"].splitlines()
    return next(row for row in rows if row.startswith(f"{number}, "))


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (("dynamic_stiffening", 0.4),),
        (("frequency_stiffening", 0.08),),
        (("cavity_air", 0.6),),
        (("wheel_free", 0.04),),
        (("spindle_tilt", 1.6e-6), ("cavity_air", 0.6)),
        (("rotation", 32.0),),
        pytest.param((("point_mass", 0.04),), marks=pytest.mark.slow),
        pytest.param((("road_contact", 1.2e5),), marks=pytest.mark.slow),
    ],
    ids=lambda effects: "-".join(name for name, _ in effects) or "plain",
)
def test_half_the_section_is_the_whole(effects: Any, both: Any) -> None:
    """Biased belts, wheel, air, spin, a mass or springs on the tread: states, modes and slopes by
    a density, by a layer's area and its angle."""
    own = edited(effects)
    slopes = {
        "density": below(own, "*DENSITY", 0),
        "area": below(own, "*REBAR LAYER", 1),
        "angle": below(own, "*REBAR LAYER", 5),
    }
    design = TyreDesign(with_values(CASE, {f"effects.{name}": size for name, size in effects}))
    request = {key: v for key, v in design.request.items() if key in adapter.REQUEST_KEYS}
    if "cavity" in request:
        request["cavity"] = CavityRequest(**request["cavity"])
    agree(*both(own, sensitivities=slopes, **request))


@pytest.mark.parametrize(
    ("numbers", "element"),
    [((2, 2, 2, 1), "CGAX8R"), ((6, 6, 6, 2), "CGAX4R"), ((5, 4, 4, 1), "CGAX8")],
    ids=["few", "linear", "more"],
)
def test_on_three_meshes(numbers: tuple[int, ...], element: str, both: Any) -> None:
    case = CASE.case
    level = case.mesh.levels["default"]
    names = ("crown", "upper_sidewall", "lower_sidewall", "bead")
    elements = dict(zip(names, numbers, strict=True))
    levels = {"default": level.model_copy(update={"elements": elements})}
    mesh = case.mesh.model_copy(update={"levels": levels, "element": element})
    agree(*both(pair(replace(CASE, case=case.model_copy(update={"mesh": mesh})))))


@pytest.mark.slow
def test_a_mass_beside_the_middle_plane(both: Any) -> None:
    """A mass off the middle plane breaks the symmetry only at its place: the forces there are
    separate."""
    own = edited((("point_mass", 0.1),))
    at = re.search(r"ELSET=POINT_MASS\n999100001, (\d+)", own["modes"])
    assert at
    beside = {name: text.replace(f", {at[1]}\n", f", {BESIDE}\n") for name, text in own.items()}
    agree(*both(own))
    half, whole = both(beside)
    for mine, its in zip(half.modes, whole.modes, strict=True):
        # of either side of the plane apart there are more responses than of both
        assert (mine.eigenvalues < its.eigenvalues * (1 + ROUND_OFF)).all()
        np.testing.assert_allclose(mine.eigenvalues, its.eigenvalues, rtol=1e-5)


BESIDE, IMAGE = 17009, 25009  # corners on the tread, each the mirror image of the other


@pytest.mark.parametrize("which", [(BESIDE,), (IMAGE,)])
@pytest.mark.parametrize("field", [1, 2])
def test_slopes_by_one_sides_coordinates(which: tuple[int, ...], field: int, both: Any) -> None:
    """Half of a variable that moves one node, while its image stays, moves both sides alike: the
    rest gives no slope."""
    own = edited(())
    lines = own["inflate"].splitlines()
    rows = [("inflate", lines.index(node(number)) + 1, field, 1.0) for number in which]
    half, whole = both(own, sensitivities={"X": rows})
    agree(half, whole)
    top = max(abs(values).max() for values in half.rates["X"])
    assert top > 1.0


def moved(number: int, R: float, Z: float) -> Edit:
    """A node's row with other coordinates."""
    row = node(number)
    _, r, z = row.split(", ")
    return row, f"{number}, {float(r) + R!r}, {float(z) + Z!r}"


@pytest.mark.parametrize(
    "edits",
    [
        [moved(BESIDE, 1e-9, 0.0)],
        [moved(BESIDE, 0.0, 1e-9)],
        [("*STEP, NAME=INFLATE", f"*BOUNDARY\n{BESIDE}, 1\n*STEP, NAME=INFLATE")],
    ],
    ids=["R", "Z", "held"],
)
def test_what_is_not_symmetric_is_solved_on_the_whole(edits: list[Edit]) -> None:
    assert job(edited(())).tyre.half
    assert not job(edited((), *edits)).tyre.half


def test_a_tyre_that_leans_has_the_frequencies_of_its_mirror_image() -> None:
    """A node moved by 2 mm, or its image: the half turn carries one tyre into the other."""
    results = []
    for number, side in ((BESIDE, 1.0), (IMAGE, -1.0)):
        leaning = job(edited((), moved(number, 2e-3, side * 1e-3)))
        assert not leaning.tyre.half
        results.append(leaning.run()[-1])
    other = mirror_images(job(edited(())).model.mesh.X)
    for one, image in zip(results[0].modes, results[1].modes, strict=True):
        np.testing.assert_allclose(one.eigenvalues, image.eigenvalues, rtol=2 * ROUND_OFF)
    np.testing.assert_allclose(results[0].U, results[1].U[other] * HALF_TURN, atol=1e-12)
    straight = job(edited(())).run()[-1]
    assert abs(results[0].modes[1].eigenvalues / straight.modes[1].eigenvalues - 1).max() > 1e-5


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
