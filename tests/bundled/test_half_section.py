"""Half of the section for the whole: the whole computation, which stays, is the judge."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled import adapter
from tyrecal_solvers.bundled import job as jobs
from tyrecal_solvers.bundled.deck.keywords import read_keywords
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck, Tangent
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import lanczos
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.nonuniform.splice import (
    FullCircle,
    SpliceSector,
    blended,
    full_circle,
    sector_modes,
)
from tyrecal_solvers.bundled.results import StepResult
from tyrecal_solvers.bundled.section import mechanics
from tyrecal_solvers.bundled.section.half_mesh import half_mesh
from tyrecal_solvers.bundled.section.kept_fields import KeptCholesky, KeptFields
from tyrecal_solvers.bundled.section.mesh import DeckMesh
from tyrecal_solvers.bundled.section.model import Model, build
from tyrecal_solvers.bundled.section.parts.part import of_each_component
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.bundled.section.symmetry import HALF_TURN, MirrorHalf, mirror_images
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import Indefinite, Refused

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.values import with_values

from ..effects.support import CASE, decks
from . import support

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
    asked = {"harmonics": HARMONICS, "modes_per_harmonic": 2, **request}
    return Job(Deck(pair, "modes", "inflate"), Request(**asked))


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
    """It breaks the symmetry, but only at its place: the forces there are apart."""
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
    """Of a variable that moves one node, whose image stays, half moves both sides alike: the rest
    gives no slope."""
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
    found = []
    for number, side in ((BESIDE, 1.0), (IMAGE, -1.0)):
        leaning = job(edited((), moved(number, 2e-3, side * 1e-3)))
        assert not leaning.tyre.half
        found.append(leaning.run()[-1])
    other = mirror_images(job(edited(())).model.mesh.X)
    for one, image in zip(found[0].modes, found[1].modes, strict=True):
        np.testing.assert_allclose(one.eigenvalues, image.eigenvalues, rtol=2 * ROUND_OFF)
    np.testing.assert_allclose(found[0].U, found[1].U[other] * HALF_TURN, atol=1e-12)
    straight = job(edited(())).run()[-1]
    assert abs(found[0].modes[1].eigenvalues / straight.modes[1].eigenvalues - 1).max() > 1e-5


@dataclass(frozen=True)
class Halves:
    """A small tyre inflated on the whole, its model of half, coordinates of its vibrations."""

    whole: Model
    half: Model
    symmetry: MirrorHalf
    free: Array
    fields: KeptFields
    U: Array
    loads: list[Pressure]


@pytest.fixture(scope="module")
def halves() -> Halves:
    tyre = support.tyre((3, 2, 2, 1))
    section = read_keywords(tyre.deck)
    whole, half = build(section, None, True), build(section, None, True, half=True)
    held, loads = support.held(whole, tyre.rim), support.cavity(whole, 240e3)
    symmetry = half.mesh.symmetry
    assert isinstance(symmetry, MirrorHalf)
    free = ~held & symmetry.here[:, None]
    fields = KeptFields(list(half.mesh.connectivity.values()), free, symmetry)
    U = support.inflate(whole, held, loads)
    return Halves(whole, half, symmetry, ~held, fields, U, loads)


def vectors(halves: Halves, random: np.random.Generator, columns: int = 2) -> Array:
    """Coordinates of random fields."""
    fields = halves.fields
    return fields.gather(fields.spread(random.normal(size=(fields.size, columns))))


def test_coordinates_are_of_kept_fields(halves: Halves, random: np.random.Generator) -> None:
    """Half turn and conjugation keep them, they are zero where the tyre is held, products are those
    of the coordinates; to one column the same happens as to many."""
    fields = halves.fields
    x, y = vectors(halves, random), vectors(halves, random)
    u, v = fields.spread(x), fields.spread(y)
    np.testing.assert_allclose(halves.symmetry.turned(u), u, atol=1e-14)
    assert not u[~halves.free].any() and (fields.free == halves.free).all()
    np.testing.assert_allclose(fields.gather(u), x, atol=1e-13)
    flat = u.reshape(-1, 2).conj().T @ v.reshape(-1, 2)
    np.testing.assert_allclose(flat, x.T @ y, atol=1e-11)
    np.testing.assert_array_equal(fields.spread(x[:, 0]), u[..., 0])
    np.testing.assert_array_equal(fields.gather(u[..., 0]), fields.gather(u)[:, 0])
    # u_r, and i times u_theta and u_z, are real on the middle plane
    middle = u[halves.symmetry.middle]
    assert not middle[:, 0].imag.any() and not middle[:, 1:].real.any()


def test_real_fields_are_a_kept_one_or_two(halves: Halves, random: np.random.Generator) -> None:
    """A real u is a + b, its coordinates are of a + i b; apart those of a and of i b."""
    fields = halves.fields
    u = random.normal(size=(*halves.free.shape, 2)) * halves.free[..., None]
    c = fields.spread(fields.gather(u))
    np.testing.assert_allclose(c.real + c.imag, u, atol=1e-13)
    apart = fields.spread(fields.apart(u))
    a, ib = apart[..., :2], apart[..., 2:]
    np.testing.assert_allclose(a - 1j * ib, u, atol=1e-13)
    assert not a.imag.any() and not ib.real.any()


@pytest.mark.parametrize("n", [0, 1, 4])
def test_matrices_on_half_are_the_wholes(
    halves: Halves, n: int, random: np.random.Generator
) -> None:
    """M x and K(n)^-1 f against dense matrices of the whole section."""
    fields, free = halves.fields, halves.free.ravel()
    x = vectors(halves, random)
    own = mechanics.mass_matrices(halves.whole)
    M = support.dense([(c, of_each_component(m, np.eye(3))) for c, m in own], len(halves.free))
    image = np.tensordot(M, fields.spread(x).reshape(-1, 2), 1) * free[:, None]
    got = fields.spread(fields.times(mechanics.mass(halves.half), x)).reshape(-1, 2)
    np.testing.assert_allclose(got, image, atol=1e-12 * abs(image).max())

    K0, K1, K2 = support.matrices(halves.whole, halves.U, halves.loads)
    K = K0 + 1j * n * K1 + n * n * K2
    loads = support.cavity(halves.half, 240e3)
    bands = [fields.assemble(p) for p in mechanics.tangents(halves.half, halves.U, loads, True)]
    band = np.asfortranarray(bands[0] + n * n * bands[2] + (1j * n * bands[1] if n else 0.0))
    given = np.asfortranarray(x)
    u = fields.spread(fields.factor(band).solve(given)).reshape(-1, 2)
    assert (given == x).all()
    force = (K @ u) * free[:, None]
    np.testing.assert_allclose(force, fields.spread(x).reshape(-1, 2), atol=1e-9)


@pytest.mark.parametrize(("band", "D", "words"), [(-2.0, 2.0, "pivot 1 of 2"), (2.0, 1.0, "plane")])
def test_what_is_not_positive_definite(band: float, D: float, words: str) -> None:
    """Two unknowns, of which the last is coupled to two on the middle plane: K = 2, E = 2."""
    corner = np.array([[2.0, 0.0], [2.0, 0.0], [0.0, 2.0]])
    phase = np.array([1.0, 1j])
    K = np.array([[band, 2.0], [0.0, 0.0]])
    corner[1, 0] = D
    with pytest.raises(Indefinite, match=words):
        KeptCholesky(np.asfortranarray(K), corner, phase)
    corner[1, 0], K[0] = 2.0 + 1e-3, 2.0
    good = KeptCholesky(np.asfortranarray(K), corner, phase)
    assert good.solve(np.ones(8)).shape == (8,)


def test_whole_fields_and_forces(halves: Halves, random: np.random.Generator) -> None:
    """Of half the elements: the state is completed, forces and sums are those of all."""
    symmetry = halves.symmetry
    even = halves.U * symmetry.here[:, None]
    np.testing.assert_allclose(symmetry.field(even), halves.U, atol=1e-15)
    own = support.cavity(halves.half, 240e3)
    half, whole = (
        mechanics.gradient(m, halves.U, p)
        for m, p in ((halves.half, own), (halves.whole, halves.loads))
    )
    np.testing.assert_allclose(symmetry.force(half), whole, atol=1e-10 * abs(whole).max())
    energy = mechanics.potential(halves.half, halves.U, own)
    assert 2 * energy == pytest.approx(mechanics.potential(halves.whole, halves.U, halves.loads))
    plain = halves.whole.mesh.symmetry
    u = random.normal(size=halves.U.shape)
    for same in (plain.field(u), plain.force(u), plain.kept(u)):
        assert same is u
    assert (plain.copies, symmetry.copies) == (1, 2)


def test_both_sides_move_alike(halves: Halves) -> None:
    X = halves.whole.mesh.X
    assert halves.symmetry.alike(X) is X
    moved = X + 1e-30j * np.arange(2 * len(X)).reshape(-1, 2)
    alike = halves.symmetry.alike(moved)
    other = halves.symmetry.other
    np.testing.assert_array_equal(alike.real, X)
    np.testing.assert_array_equal(alike.imag[other], alike.imag * [1, -1])
    R = (moved.imag[:, 0] + moved.imag[other, 0]) / 2
    np.testing.assert_array_equal(alike.imag[:, 0], R)


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
    """Those of which half stands for all; what lies across the middle counts by half."""
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


@pytest.fixture(scope="module")
def circles(halves: Halves) -> tuple[Circles, Circles]:
    """Half of a tyre with a stiffer and heavier sector, and all of it, as inflated without."""
    numbering = support.numbering(halves.whole, ~halves.free)
    return (
        Circles.of(halves.half, halves.U, support.cavity(halves.half, 240e3), halves.fields),
        Circles.of(halves.whole, halves.U, halves.loads, numbering),
    )


@dataclass(frozen=True)
class Circles:
    """A spliced tyre and what its modes are asked with."""

    model: Model
    loads: list[Pressure]
    vibration: Vibration
    sector: SpliceSector
    fields: FullCircle
    rest: Array  # forces out of balance in the plain state

    @classmethod
    def of(cls, model: Model, U: Array, loads: list[Pressure], coordinates: Any) -> Circles:
        top, around = 3, full_circle(3)
        sector = SpliceSector(0.5, support.stiffer(model, 0.3))
        share = sector.share(2 * np.pi * np.arange(13) / 13, 2 * top)
        vibration = Vibration(model, U, loads, coordinates, 0.0)
        tyre = Revolved(blended(model, sector.model, share), loads, around)
        fields = FullCircle(vibration, tyre, sector, top)
        return cls(
            model, loads, vibration, sector, fields, fields.out_of_balance(np.repeat(U[None], 7, 0))
        )


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_fields_round_a_spliced_tyre_on_half_the_section(
    circles: tuple[Circles, Circles], turn: float, random: np.random.Generator
) -> None:
    """Forces, inertia and responses of what half a turn keeps, and of what it reverses."""
    half, whole = (each.fields for each in circles)
    assert (half.turn, whole.turn) == (1.0, 0.0)
    own = half.turning(turn)
    u = random.normal(size=(7, *half.free.shape)) * half.free
    kept = own.part(u)
    np.testing.assert_allclose(own.turned(kept), turn * kept, atol=1e-13)
    np.testing.assert_allclose(kept + half.turning(-turn).part(u), u, atol=1e-13)
    assert whole.part(u) is u and whole.whole(u) is u
    for name in ("forces", "inertia", "response"):
        mine, its = getattr(own, name)(kept), getattr(whole, name)(kept)
        np.testing.assert_allclose(mine, its, atol=1e-9 * abs(its).max())
    rest = [each.rest for each in circles]
    np.testing.assert_allclose(*rest, atol=1e-10 * abs(rest[1]).max())


@pytest.mark.slow
def test_modes_of_a_spliced_tyre_on_half_the_section(
    circles: tuple[Circles, Circles], halves: Halves
) -> None:
    """One of each doublet is kept by half a turn, one reversed; both kinds are told together."""
    half, whole = (
        sector_modes(c.vibration, halves.U, c.loads, c.model, c.sector, [0, 1, 2], 2, beyond=2)
        for c in circles
    )
    for mine, its in zip(half, whole, strict=True):
        apart = abs(its.eigenvalues[1] / its.eigenvalues[0] - 1)
        assert apart > 1e-4
        np.testing.assert_allclose(mine.eigenvalues, its.eigenvalues, rtol=1e-3 * apart)
        for u, v in zip(mine.shapes, its.shapes, strict=True):
            lengths = np.linalg.norm(u), np.linalg.norm(v)
            assert abs(np.vdot(u, v)) == pytest.approx(lengths[0] * lengths[1], rel=1e-4)
            assert lengths[0] == pytest.approx(lengths[1], rel=1e-4)


def test_a_splice_is_solved_on_half_where_the_sector_is_symmetric_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    texts = decks(CASE, stiffness_splice=0.5)
    sector = read_keywords(texts["splice.inp"])
    own = Deck({name: texts[f"{name}.inp"] for name in ("inflate", "modes")}, "modes", "inflate")
    asked = Request(harmonics=[0], sector={"job": "splice", "width_deg": 10.0})
    assert Job(own, asked, sector=sector).tyre.half
    kept = jobs.keeps_half_turn
    lopsided = lambda mesh, filled, steps: filled != sector and kept(mesh, filled, steps)
    monkeypatch.setattr(jobs, "keeps_half_turn", lopsided)
    assert not Job(own, asked, sector=sector).tyre.half and Job(own, asked).tyre.half
