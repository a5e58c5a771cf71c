"""Masses and springs on nodes of the tyre: where they act, and what they weigh."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.section.model import build
from tyrecal_solvers.bundled.section.point_elements import read_point_elements
from tyrecal_solvers.language.text import DeckError

from .job_pairs import MASS, PLAIN, texts


def test_masses_and_springs_stand_in_their_components() -> None:
    """A mass in all three; springs along 1, 2 and 3 radially, along the axle, round it; two on one
    node add up; the mean over a sector of one of 60."""
    pair = dict(texts(MASS))
    springs = (
        "*ELEMENT, TYPE=SPRING1, ELSET=K{0}\n99910001{0}, {1}\n*SPRING, ELSET=K{0}\n{0}\n{2}\n"
    )
    more = "".join(
        springs.format(i, n, k) for i, n, k in ((1, 21009, 1e3), (2, 21009, 2e3), (3, 19009, 3e3))
    )
    pair["modes"] = pair["modes"].replace("*STEP, NAME=EQ", more + "*STEP, NAME=EQ")
    deck = Deck(pair, "modes", "inflate")
    model = Job(deck, Request()).model
    _, revolve, _ = deck.read([])
    elements = read_point_elements(revolve, model.mesh)
    at = {
        (int(r), int(c)): (m, k)
        for r, c, m, k in zip(
            elements.rows, elements.components, elements.mass, elements.stiffness, strict=True
        )
    }
    one, other = model.mesh.index[21009], model.mesh.index[19009]
    assert at == {
        (one, 0): (0.1, 1e3),
        (one, 1): (0.1, 0.0),
        (one, 2): (0.1, 2e3),
        (other, 1): (0.0, 3e3),
    }
    assert elements.total_kg == pytest.approx(0.1) and elements.sectors == elements.highest == 60
    angle = np.linspace(-np.pi / 60, np.pi / 60, 2001)
    for n in (0, 1, 7):
        assert elements.share(n) == pytest.approx(np.mean(np.cos(n * angle)), rel=1e-3)
    for n in (0, 1):
        assert elements.share(n) == pytest.approx(trapezoid(np.cos(n * angle), angle) * 30 / np.pi)
    bad = springs.format(4, 21009, 1e3)
    pair["modes"] = pair["modes"].replace("*STEP, NAME=EQ", bad + "*STEP, NAME=EQ")
    _, revolve, _ = Deck(pair, "modes", "inflate").read([])
    with pytest.raises(DeckError, match="a spring acts along 1, 2 or 3, got 4"):
        read_point_elements(revolve, model.mesh)


def test_the_mass_is_the_sections_and_what_is_attached() -> None:
    """Volume by Pappus's rule times density, the plies' thickness being none, and 0.1 kg."""
    plain, more = (Job(Deck(texts(e), "modes", "inflate"), Request()) for e in (PLAIN, MASS))
    whole = build(Deck(texts(PLAIN), "modes", "inflate").read([])[0], None, True)
    rubber, cords = (part.mass.sum() for part in whole.parts)
    assert plain.mass_kg == pytest.approx(2 * np.pi * (rubber + cords), rel=1e-9)
    assert 10 < plain.mass_kg < 16
    assert more.mass_kg - plain.mass_kg == pytest.approx(0.1)
