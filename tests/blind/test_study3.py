"""The makers of blind study 3: their sections, their modes, what they say of nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import label_modes
from tyrecal.simulate.modes.match import match
from tyrecal.studies.blind.make import labels_of
from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.load import load_case

from ..studies.judge import tyre_told
from ..studies.judge_section import LINES
from ..studies.judge_section import section as stations_section
from ..studies.test_fenics import installed
from .study3.cases import LABELS, SIZES, Group, written
from .study3.maker import Fenics, modes
from .study3.section import Section, columns, mould, off, section
from .study3.tyre import Mesh, Tyre, problem, tyre_of

ROOT = Path(__file__).parents[2]
ALIKE = {"harmonics": [0, 1, 2, 3, 4], "modes": 3, "degree": 3}


@pytest.fixture(scope="module")
def fenics() -> Iterator[Fenics]:
    if not installed():
        pytest.skip("FEniCSx is not installed here (apt-get install python3-dolfinx)")
    process = Fenics()
    yield process
    process.close()


def tyre(size: str, folder: Path) -> Tyre:
    """As the maker builds it with the numbers of the case that `tyrecal init` writes."""
    case = written(Group(size, False), folder, {str(label): 50.0 for label in LABELS})
    return tyre_of(case, mould(size), columns(mould(size)))


@pytest.mark.parametrize("size", SIZES)
def test_a_section_has_the_size_s_dimensions_and_no_folded_element(size: str) -> None:
    m = mould(size)
    made = section(m, columns(m))
    outer = made.points[-1]
    assert 2 * outer[0, 0] == pytest.approx(2 * m.crown, abs=1e-9)
    assert made.points[:, 0, 1] == pytest.approx(np.zeros(len(m.lines)), abs=1e-12)
    assert np.all(np.diff(made.offsets, axis=0) > 1e-4)
    p, counts = made.points, np.array(columns(m))
    a, b = np.diff(p, axis=0)[:, :-1], np.diff(p, axis=1)[:-1]
    assert np.all(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0] > 0) and counts.min() > 0


def test_tyres_of_one_mould_differ_by_what_is_stated() -> None:
    """Root mean square over 200 tyres of the meridian's mean distance, to a quarter: their waves
    are scaled by a normal number, whose mean square scatters by 10 %.

    False failures: 1e-2 of a percent, none with this seed.
    """
    m = mould("205/60R15")
    counts, random = columns(m), np.random.default_rng(5)
    known, apart = section(m, counts), []
    for _ in range(200):
        other = section(
            replace(off(m, random, 1e-3, 0.0), filler=m.filler, turn_up=m.turn_up), counts
        )
        apart.append(np.mean(np.sum((other.points[1] - known.points[1]) ** 2, 1)))
    assert np.sqrt(np.mean(apart)) == pytest.approx(1e-3, rel=0.25)


def on_the_same_stations(case: LoadedCase) -> dict[str, Any]:
    """The case's own stations and laws, for the maker's solver: nothing of its sections."""
    told = tyre_told(case)
    lines, belted = stations_section(told["stations"], 12, 20)
    middle = lines.shape[1] // 2
    half, belted = lines[:, middle:], belted[middle:]
    places = np.arange(half.shape[1], dtype=float)
    mesh = Mesh.of(Section(mould("P235/75R17"), half, half[..., 0], places, {}))
    count = mesh.rows * (half.shape[1] // 2)
    whole = lambda value: [value] * (2 * count)
    table = {key: np.zeros((2, mesh.rows, half.shape[1] // 2)) for key in ("k", "angle", "m")}
    for name, cord in told["cords"].items():
        there = belted[1::2] | (name == "ply")
        row, per_m = LINES.index(name) - 1, cord["area"] / cord["spacing"]
        table["k"][0, row, there] = cord["modulus"] * per_m
        table["angle"][0, row, there] = np.radians(cord["angle_deg"])
        table["m"][0, row, there] = cord["density"] * per_m
    state = {key: whole(told[key]) for key in ("C10", "D1", "density")}
    state |= {key: whole(0.0) for key in ("dynamic_C10", "hoop_Pa", "lining", "prestrain")}
    state |= {"stiffness": table["k"].ravel().tolist(), "angle": table["angle"].ravel().tolist()}
    state |= {"area_density": table["m"].ravel().tolist(), "pressure": told["pressure"]}
    laws_alike = {"cord_law": "logarithmic", "volume_law": "J - 1"}
    return {**mesh.told(np.inf), **laws_alike, **ALIKE, "states": [state]}


@pytest.mark.slow
def test_on_the_same_stations_with_the_same_laws_both_solvers_agree(fenics: Fenics) -> None:
    """Within 0.5 %: what is left are elements, and how stations are joined."""
    case = with_level(load_case(ROOT / "cases" / "p235_75r17.yaml"), "default")
    labels = labels_of(case)
    answer = Evaluator(TyreDesign(case), "bundled").evaluate(Question({}))
    ours = match(label_modes(answer.modes), labels)
    found = fenics.ask(on_the_same_stations(case))
    theirs = modes(found, found["states"][0], labels)
    for label in labels:
        assert theirs[label] == pytest.approx(ours[label].frequency_Hz, rel=5e-3)


@pytest.mark.slow
def test_the_mass_is_that_of_the_section_s_own_integral(tmp_path: Path, fenics: Fenics) -> None:
    """By Pappus and Guldin, by quadrangles as long as elements and half as long: with their error
    of second order taken off, 0.02 %."""
    told = tyre("175/70R13", tmp_path)
    asked = {**problem(told, [240.0]), "harmonics": []}
    points, state = section(told.mould, told.columns).points, asked["states"][0]
    count = (points.shape[0] - 1, (points.shape[1] - 1) // 2)

    def mass(each: int) -> float:
        p = points[:, :: 2 // each]
        density, on_lines = (
            np.repeat(np.array(state[key])[: count[0] * count[1]].reshape(count), each, 1)
            for key in ("density", "area_density")
        )
        one, two = p[1:, 1:] - p[:-1, :-1], p[1:, :-1] - p[:-1, 1:]
        area = abs(one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]) / 2
        radius = (p[1:, 1:] + p[:-1, :-1] + p[1:, :-1] + p[:-1, 1:])[..., 0] / 4
        length = np.linalg.norm(p[1:, 1:] - p[1:, :-1], axis=-1)
        at = (p[1:, 1:] + p[1:, :-1])[..., 0] / 2
        return 4 * np.pi * float((density * area * radius + on_lines * length * at).sum())

    whole = (4 * mass(2) - mass(1)) / 3
    assert fenics.ask(asked)["mass_kg"] == pytest.approx(whole, rel=2e-4)
