"""Files that the adapter writes for a job of the bundled solver, and how it reads the results."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import Bundled
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.results import write

from .job_pairs import MASS, PLAIN, texts


def test_the_adapter_writes_the_decks_and_what_they_cannot_say(tmp_path: Path) -> None:
    """Harmonics up to the highest, and of the rest what the tool asks for; a pressed tyre's deck
    says all but the slopes."""
    tangents = {"p": [("modes", 3, 0, 1.0)]}
    decks: Any = SimpleNamespace(
        request={"highest_harmonic": 3, "modes_per_harmonic": 4, "own_frequency": True, "other": 1},
        loads_N=(),
        start=None,
        pressed_start=None,
        texts=lambda dialect: {"modes.inp": f"** ä {dialect}\n"},
        tangents=lambda dialect: tangents,
    )
    deck, request = Bundled().write(decks, tmp_path)
    assert deck.name == "modes.inp" and deck.read_bytes() == "** ä abaqus\n".encode()
    assert request.name == "modes.request.json"
    assert json.loads(request.read_text()) == {
        "harmonics": [0, 1, 2, 3],
        "modes_per_harmonic": 4,
        "sensitivities": {"p": [["modes", 3, 0, 1.0]]},
        "own_frequency": True,
    }
    request.unlink()
    decks.loads_N = (100.0,)
    deck, request = Bundled().write(decks, tmp_path)
    assert request.name == "press.request.json"
    assert json.loads(request.read_text()) == {"sensitivities": {"p": [["modes", 3, 0, 1.0]]}}
    request.unlink()
    tangents.clear()
    assert Bundled().write(decks, tmp_path) == [deck] and not request.exists()


def test_the_two_that_a_doublet_has_split_into_are_read_as_one(tmp_path: Path) -> None:
    """The adapter reads both frequencies, the mean of them and of their slopes, and the first
    shape."""
    density = texts(MASS)["inflate"].splitlines().index("*DENSITY") + 2
    sensitivities = {"p": [("inflate", density, 0, 1.0)]}
    job = Job(Deck(texts(MASS), "modes", "inflate"), Request([0, 1], 2, sensitivities))
    (result,) = job.run()
    write(tmp_path / "modes", job.model, [result])
    answer = Bundled().read(tmp_path)
    shapes = np.load(tmp_path / "modes.npz")["shapes_2"]
    order = np.sort(np.concatenate([m.eigenvalues for m in result.modes]))
    wanted = {}
    for m, rates in zip(result.modes, result.rates["p"], strict=True):
        size, hertz = 2 if m.n else 1, np.sqrt(m.eigenvalues) / (2 * np.pi)
        for i in range(0, len(hertz), size):
            own = slice(i, i + size)
            slope = (rates[own] / (8 * np.pi**2 * hertz[own])).mean()
            first = shapes[np.flatnonzero(order == m.eigenvalues[i])[0]]
            wanted[hertz[own].mean()] = m.n, size, list(hertz[own]), slope, first
    assert len(answer["modes"]) == len(wanted) == 4
    for mode, slope in zip(answer["modes"], answer["gradients"]["p"], strict=True):
        place = min(wanted, key=lambda f, mode=mode: abs(f - mode["frequency_Hz"]))
        n, size, members, own, shape = wanted[place]
        assert mode["frequency_Hz"] == pytest.approx(place) and slope == pytest.approx(own)
        assert (mode["n"], mode["multiplicity"]) == (n, size)
        assert mode.get("members", members) == pytest.approx(members)
        assert ("members" in mode) == (n > 0)
        np.testing.assert_array_equal(mode["amplitude"], shape)
    assert (answer["mass_kg"], answer["pressure_Pa"]) == (job.mass_kg, 160e3)
    np.testing.assert_array_equal(answer["displacement"], result.U)
    np.testing.assert_array_equal(answer["points"], job.model.mesh.X)
    assert answer["nodes"].tolist() == list(job.model.mesh.index)


def test_modes_are_written_by_rising_frequency(tmp_path: Path) -> None:
    """Shapes and slopes keep this order, whatever their harmonics."""
    lines = texts(PLAIN)["inflate"].splitlines()
    density = lines.index("*DENSITY") + 2
    deck = Deck(texts(PLAIN), "modes", "inflate")
    sensitivities = {"rho": [("inflate", density, 0, 1.0)]}
    analysis = Job(deck, Request(harmonics=[2, 0, 1], sensitivities=sensitivities))
    (result,) = analysis.run()
    write(tmp_path / "modes", analysis.model, [result])
    (step,) = json.loads((tmp_path / "modes.json").read_text())["steps"]
    hertz = [mode["frequency_Hz"] for mode in step["modes"]]
    assert hertz == sorted(hertz) and len(hertz) == 6
    shapes = np.load(tmp_path / "modes.npz")["shapes_2"]
    for mode, slope, shape in zip(step["modes"], step["sensitivities"]["rho"], shapes, strict=True):
        place = [m.n for m in result.modes].index(mode["n"])
        own = result.modes[place]
        j = int(np.argmin(abs(own.eigenvalues - mode["eigenvalue"])))
        assert own.eigenvalues[j] == mode["eigenvalue"]
        circle = np.pi if mode["n"] else 2 * np.pi
        assert shape == pytest.approx(own.shapes[j] / np.sqrt(circle), rel=1e-5, abs=1e-6)
        rate = result.rates["rho"][place][j]
        assert slope == pytest.approx(rate / (8 * np.pi**2 * mode["frequency_Hz"]))
