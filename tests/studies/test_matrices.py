"""Reduced matrices of the inflated tyre, read by NumPy alone: against the modes, against the force
on the hub as `tyrecal frf` has it, and with the rim's mass added against the free wheel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import DeckRefused
from tyrecal.studies import matrices as exported
from tyrecal.studies.matrices import POINT_ANGLES, matrix_files
from tyrecal.studies.response import HUB_CHANNELS, response_request
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..cli.test_cli import run
from ..conftest import CASES

pytestmark = pytest.mark.numbers
PATCH_MM, TO_HZ = 180.0, 300.0  # of which few harmonics are enough
WAYS = ("radial", "lateral", "tangential", "radial", "lateral")
POINTS = ",".join(f"tread:{a}deg:{way}" for a, way in zip(POINT_ANGLES, WAYS, strict=True))


def read_matrix_market(content: bytes) -> np.ndarray:
    """A matrix of a Matrix Market file."""
    lines = content.decode().splitlines()
    (rows, columns, _), *entries = [line.split() for line in lines[1:] if not line.startswith("%")]
    matrix = np.zeros((int(rows), int(columns)))
    for i, j, value in entries:
        matrix[int(i) - 1, int(j) - 1] = float(value)
        if lines[0].endswith("symmetric"):
            matrix[int(j) - 1, int(i) - 1] = float(value)
    return matrix


@pytest.fixture(scope="module")
def case() -> LoadedCase:
    """The coarse main tyre, with a loss factor of each compound."""
    case = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
    losses = {f"materials.{name}.loss_factor": 0.1 for name in ("rubber",)}
    return with_values(case, losses)


@pytest.fixture(scope="module")
def files(case: LoadedCase) -> dict[str, bytes]:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(exported, "MATRIX_PATCH_mm", PATCH_MM)
        return matrix_files(case, "", 200.0, points=POINTS)


@pytest.fixture(scope="module")
def read(files: dict[str, bytes]) -> dict[str, np.ndarray]:
    return {
        Path(name).stem: read_matrix_market(content)
        for name, content in files.items()
        if name.endswith(".mtx")
    }


def values_at(case: LoadedCase, **numbers: float) -> dict[str, float]:
    return {**start_values(case), "pressure_kPa": 200.0, **numbers}


def hertz(read: dict[str, np.ndarray], free: slice, rim: np.ndarray) -> np.ndarray:
    """Frequencies with the coordinates ``free``, and mass and inertia of a rim on the hub's."""
    mass = read["mass"].copy()
    mass[:6, :6] += np.diag(rim)
    root = np.linalg.inv(np.linalg.cholesky(mass[free, free]))
    values = np.linalg.eigvalsh(root @ read["stiffness"][free, free] @ root.T)
    return np.sqrt(np.maximum(values, 0)) / (2 * np.pi)


@pytest.mark.slow
def test_matrices_have_the_modes_and_the_forces_on_the_hub(
    case: LoadedCase, read: dict[str, np.ndarray]
) -> None:
    """Frequencies to 1e-6, forces and moments within 0.5 dB where they are above a thousandth of
    the largest, by 200 coordinates."""
    request = response_request(POINTS, POINTS, 0.0, TO_HZ, 2.0, PATCH_MM)
    answer = Evaluator(TyreDesign(case)).evaluate(Question(values_at(case), response=request))
    assert len(read["mass"]) <= 200
    assert read["mass"][0, 0] == pytest.approx(answer.mass_kg, rel=1e-9)
    own = hertz(read, slice(6, None), np.zeros(6))
    for mode in answer.modes:
        assert np.abs(own / mode.frequency_Hz - 1).min() < 1e-6
        assert np.sum(np.abs(own / mode.frequency_Hz - 1) < 1e-6) == mode.multiplicity
    frequencies = np.array(answer.response["frequency_Hz"])
    squares = (2 * np.pi * frequencies[:, None, None]) ** 2
    Z = read["stiffness"] + 1j * read["loss"] - squares * read["mass"]
    forces = read["tread"].T + 0j
    q = np.linalg.solve(Z[:, 6:, 6:], np.broadcast_to(forces[6:], (len(Z), *forces[6:].shape)))
    on_hub = forces[:6] - Z[:, :6, 6:] @ q
    for k, (place, sign) in enumerate(HUB_CHANNELS.values()):
        full = sign * np.array(answer.response["hub"])[place].T  # (f, points)
        large = np.abs(full) > 1e-3 * np.abs(full).max()
        assert large.sum() > 100
        decibels = 20 * np.log10(np.abs(on_hub[:, k][large] / full[large]))
        assert np.abs(decibels).max() < 0.5


@pytest.mark.slow
def test_with_the_rims_mass_they_are_the_free_wheel(
    case: LoadedCase, read: dict[str, np.ndarray]
) -> None:
    """The modes of a wheel that hangs freely, by another part of the solver."""
    rim = case.case.rim
    numbers = values_at(case, **{"rim.free": True})
    answer = Evaluator(TyreDesign(case)).evaluate(Question(numbers))
    tilt, spin = rim.diametral_inertia_kg_m2, rim.polar_inertia_kg_m2
    inertia = np.array([rim.mass_kg] * 3 + [tilt, spin, tilt])
    own = hertz(read, slice(None), inertia)
    assert np.sum(own < 1e-2) == 6  # the wheel moves freely
    for mode in answer.modes:
        assert np.abs(own / mode.frequency_Hz - 1).min() < 1e-4


@pytest.mark.slow
def test_abaqus_has_the_same_matrices(files: dict[str, bytes], read: dict[str, np.ndarray]) -> None:
    """By the entries' node and degree of freedom; a point's motion is an equation."""
    index = lambda node, dof: int(dof) - 1 if node == "1" else 6 * (int(node) - 1000) + int(dof) - 1
    for name in ("stiffness", "mass", "loss"):
        matrix = np.zeros_like(read[name])
        for line in files[f"tyre_{name}.inp"].decode().splitlines():
            a, i, b, j, value = line.split(", ")
            matrix[index(a, i), index(b, j)] = matrix[index(b, j), index(a, i)] = float(value)
        assert np.allclose(matrix, read[name], rtol=1e-14, atol=0)
    text = files["tyre.inp"].decode()
    assert "STRUCTURAL DAMPING=TYRE_LOSS" in text and text.count("*EQUATION") == len(POINT_ANGLES)
    assert "200 coordinates" in files["README.txt"].decode().splitlines()[0]


def test_options_of_matrices_are_refused_elsewhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("export", str(tmp_path), "--modes", "20") == 2
    assert "--modes goes with --format matrices" in capsys.readouterr().err


@pytest.mark.slow
def test_too_few_coordinates_are_refused(case: LoadedCase) -> None:
    """The sentence states how many the hub needs."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(exported, "MATRIX_PATCH_mm", PATCH_MM)
        with pytest.raises(DeckRefused, match=r"matrices need at least \d\d coordinates of modes"):
            matrix_files(case, "", 200.0, 20, POINTS)


@pytest.mark.parametrize("bar", [2.4, -5, 2400])
def test_a_pressure_that_no_tyre_has_is_refused(case: LoadedCase, bar: float) -> None:
    """So one in bar is not taken as one in kPa."""
    with pytest.raises(InputError, match=f"the pressure is {bar:g} kPa: usual is 50 to 1200 kPa"):
        matrix_files(case, "", bar)
