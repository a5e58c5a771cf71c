"""Makers' laws: near the catalogue's in what they do, but not the same; families outside it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import uniform

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import Label, paired_labels
from tyrecal.studies.blind.maker import OUTSIDE_FAMILIES, EffectLaw
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.values import with_values

from ..chance import Chance, generator
from .__main__ import finer, other_maker
from .emulated import emulate
from .laws import divided, other_laws
from .toy import CASE, Scale

LABELS = [Label(t.c, t.m, t.kind) for t in CASE.case.targets.modes]  # type: ignore[union-attr]
AT = with_values(CASE, {"pressure_kPa": 160.0})
ABLE = Evaluator(TyreDesign(CASE)).solver.capabilities
CHEAP = sorted(set(other_laws(frozenset({"modes"}))))


def ln_f(case: LoadedCase) -> np.ndarray:
    frequencies = {
        m.label: m.frequency_Hz
        for m in paired_labels(Evaluator(TyreDesign(case)).evaluate(Question({})).modes)
    }
    return np.log([frequencies[label] for label in LABELS])


PLAIN = ln_f(AT)


def test_calculix_can_make_at_least_twelve_effects_and_four_families() -> None:
    assert len(CHEAP) >= 12 and len(OUTSIDE_FAMILIES) >= 4
    assert not set(OUTSIDE_FAMILIES) & set(catalogue())
    assert set(other_maker("calculix", CASE).laws) == set(CHEAP)
    for id, law in other_laws(frozenset(ABLE)).items():
        assert (law.low, law.high) == (catalogue()[id].low, catalogue()[id].high)


@pytest.mark.parametrize("id", CHEAP)
def test_a_law_does_what_the_catalogue_s_does_by_another_way(id: str) -> None:
    law, size = other_laws(frozenset(ABLE))[id], 0.6 * catalogue()[id].high
    own, theirs = ln_f(law.add(AT, size)) - PLAIN, ln_f(catalogue()[id].add(AT, size)) - PLAIN
    assert abs(own).max() > 2e-4
    assert abs(own - theirs).max() > 0.02 * abs(theirs).max()  # not the same law
    if id not in ("carcass_fanning", "carcass_turn_up"):  # small, and absorbed by A_carcass
        assert own @ theirs > 0.6 * np.linalg.norm(own) * np.linalg.norm(theirs)


@pytest.mark.parametrize(
    "name", sorted(name for name, law in OUTSIDE_FAMILIES.items() if not law.read)
)
def test_a_family_moves_frequencies(name: str) -> None:
    assert (
        abs(ln_f(OUTSIDE_FAMILIES[name].add(AT, OUTSIDE_FAMILIES[name].high)) - PLAIN).max() > 2e-3
    )


def test_a_resonance_of_the_stand_is_read_at_every_pressure() -> None:
    law, stood, other = OUTSIDE_FAMILIES["stand_resonance"], Label(1, 0), Label(2, 0)
    heard = {p: {stood: (np.log(p), np.log(p)), other: (5.0, 5.1)} for p in (160.0, 240.0, 320.0)}
    assert law.add(AT, 0.1) is AT and law.read
    read = law.read(heard, 0.1)
    assert all(ln_f[stood] == pytest.approx([np.log(264.0)] * 2) for ln_f in read.values())
    assert all(ln_f[other] == (5.0, 5.1) for ln_f in read.values())


def test_a_divided_region_is_the_same_tyre() -> None:
    made, names = divided(AT, "lower_sidewall", 3)
    assert len(names) == 3 and ln_f(made) == pytest.approx(PLAIN, abs=1e-5)


def test_a_finer_mesh_is_another_one() -> None:
    off = abs(ln_f(finer(AT)) - PLAIN).max()
    assert 1e-5 < off < 0.05


def test_sizes_are_drawn_on_both_sides(chance: Chance) -> None:
    """Half of them negative, evenly between 0.2 and 1 of each end.

    False failures: 3e-7.
    """
    law = EffectLaw(-1.0, 2.0, lambda case, e: case)
    drawn = np.array([law.drawn(chance.random, 0.2) for _ in range(200)])
    assert all(-1 <= e <= -0.2 or 0.4 <= e <= 2 for e in drawn)
    chance.often(drawn > 0, 0.5, 0.5)
    chance.distributed(-drawn[drawn < 0], uniform(0.2, 0.8).cdf)
    chance.distributed(drawn[drawn > 0], uniform(0.4, 1.6).cdf)


def test_the_emulated_model_is_the_model_between_its_designs_and_goes_straight_on_beyond() -> None:
    scale = Scale()
    twin = emulate(scale)
    random, count = generator(1), scale.asked
    for _ in range(10):
        x = scale.start + random.uniform(-0.7, 0.7, 3)
        point = Query(x, {"e1": float(random.uniform(0, 1))}, constants=True)
        (got,) = twin.answers([point])
        (want,) = scale.answers([point])
        assert isinstance(got, Answer) and isinstance(want, Answer)
        for name in ("eta", "jacobian", "constants"):
            assert np.allclose(getattr(got, name), getattr(want, name), atol=1e-6)
    assert scale.asked == count + 10
    edge, beyond = (Query(scale.start + step * np.array([1.0, 0.2, 0.1])) for step in (0.8, 1.3))
    at, after = twin.answers([edge, beyond])
    assert isinstance(at, Answer) and isinstance(after, Answer) and scale.asked == count + 10
    assert np.allclose(after.jacobian[:, 0], at.jacobian[:, 0], atol=0.05)
    middle = at.eta + at.jacobian[:, 0] * 0.5
    rest = after.eta - middle  # what the other two, still inside, add
    inside = twin.answers([Query(scale.start + np.array([0.8, 0.26, 0.13]))])[0]
    assert isinstance(inside, Answer)
    assert np.allclose(rest, inside.eta - at.eta + 0.5 * (inside.jacobian - at.jacobian)[:, 0])
    assert np.allclose(after.jacobian, inside.jacobian)
