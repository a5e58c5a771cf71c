"""A tyre with a stiffer and heavier sector on half of its section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled import job as jobs
from tyrecal_solvers.bundled.deck.request import Request, SectorRequest
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.nonuniform.splice import (
    FullCircle,
    SpliceSector,
    blended,
    full_circle,
    sector_modes,
)
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.language.text import read_keywords

from ..effects.support import CASE, decks
from . import support
from .halves import Halves

Array = np.ndarray


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


@pytest.fixture(scope="module")
def circles(halves: Halves) -> tuple[Circles, Circles]:
    """Half of a tyre with a stiffer and heavier sector, and all of it, as inflated without."""
    numbering = support.numbering(halves.whole, ~halves.free)
    return (
        Circles.of(halves.half, halves.U, support.cavity(halves.half, 240e3), halves.fields),
        Circles.of(halves.whole, halves.U, halves.loads, numbering),
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
    """Half a turn keeps one mode of each doublet and reverses the other; results list both kinds
    together."""
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
    request = Request(harmonics=[0], sector=SectorRequest("splice", 10.0))
    assert Job(own, request, sector=sector).tyre.half
    kept = jobs.keeps_half_turn
    lopsided = lambda mesh, filled, steps: filled != sector and kept(mesh, filled, steps)
    monkeypatch.setattr(jobs, "keeps_half_turn", lopsided)
    assert not Job(own, request, sector=sector).tyre.half and Job(own, request).tyre.half
