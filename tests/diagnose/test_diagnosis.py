"""The whole on a tyre in closed form: held-out data, the placebo, the next measurement, anchors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from tyrecal.report.diagnosis import page
from tyrecal.simulate.modes.mode import Label
from tyrecal.studies.diagnose.diagnosis import Diagnosis, diagnose
from tyrecal.studies.diagnose.evidence import explain, weigh
from tyrecal.studies.diagnose.expansion import anchored, expand
from tyrecal.studies.diagnose.inverse_problem import Toggle
from tyrecal.studies.diagnose.model import Answer, Query
from tyrecal.studies.diagnose.next_measurement import rank
from tyrecal.studies.diagnose.observations import Observable
from tyrecal.studies.diagnose.regions import SectionPart
from tyrecal.studies.diagnose.result import result
from tyrecal.studies.diagnose.shrinkage import held_out, shrink
from tyrecal.studies.diagnose.study import DiagnosedCase

from ..chance import Chance, generator
from .toy import LABELS, Toy, drawn, problem

pytestmark = pytest.mark.numbers


def diagnosed(toy: Toy, effects: dict[str, float], seed: int, **keys: object) -> Diagnosis:
    base = problem(toy)
    y = drawn(toy, base, generator(seed), effects, 0.3)
    return diagnose(toy, toy.rows, base.measured(y).observations, assumed=base.assumed, **keys)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("pressures", "held"),
    [((160.0, 240.0, 320.0), {240.0}), ((160.0, 240.0), {160.0}), ((240.0,), set())],
)
def test_what_is_held_out_follows_a_rule(pressures: tuple[float, ...], held: set[float]) -> None:
    rows = [Observable("frequency_Hz", x, p) for p in pressures for x in LABELS]
    rows.append(Observable("mass_kg", None, 0.0))
    mask, _ = held_out(rows)
    chosen = [row for row, h in zip(rows, mask, strict=True) if h]
    if held:
        assert {row.pressure_kPa for row in chosen} == held
        assert len(chosen) == len(LABELS)
    else:
        assert {row.label for row in chosen} == {Label(4, 0), Label(3, 1)}
    assert all(row.label for row in chosen)


def test_an_effect_shrinks_the_held_out_error(chance: Chance) -> None:
    """Beyond the placebo's quantile, and least squares' error too, in 17 of 20 tyres.

    False failures: 2e-7.
    """
    toy = Toy(size=0.02, pressures=(160.0, 200.0, 240.0))
    base, shrunk, usual = problem(toy), [], []
    for _ in range(12):
        there = base.measured(drawn(toy, base, chance.random, {"e1": 0.9}, 0.3))
        s = shrink(there)
        assert s is not None and s.low <= s.high
        shrunk.append(s.effect == "e1" and s.fraction > s.placebo_95)
        usual.append(s.least_squares_after_percent < s.least_squares_before_percent)
    chance.often(shrunk, 0.85)
    chance.often(usual, 0.85)


def test_an_effect_is_told_with_the_rung_that_its_shrinkage_gives() -> None:
    found = diagnosed(Toy(size=0.02, pressures=(160.0, 200.0, 240.0)), {"e1": 0.9}, 1)
    s = found.shrinkage
    assert s is not None
    named = found.verdict.kind == "named"
    assert found.rung == 2 or not (named and s.effect == "e1" and s.fraction > s.placebo_95)


def test_without_an_effect_the_error_shrinks_beyond_the_placebo_in_one_of_twenty(
    chance: Chance,
) -> None:
    """The placebo's quantile is of 200 draws, and of a model linear in x: 3 to 8 of 100.

    False failures: 1e-7.
    """
    toy = Toy(size=0.02, pressures=(160.0, 200.0, 240.0))
    base, beyond = problem(toy), []
    for _ in range(16):
        there = base.measured(drawn(toy, base, chance.random, {}, 0.0))
        fake = shrink(there)
        assert fake is not None
        beyond.append(fake.fraction > fake.placebo_95)
    chance.often(beyond, 0.03, 0.08)


@pytest.mark.parametrize("without", [True, False])
def test_a_calibration_as_usual_stands_beside(without: bool) -> None:
    """Least squares of the other rows, by SciPy on the tyre itself, without and with the effect."""
    toy = Toy(size=0.02, pressures=(160.0, 200.0, 240.0))
    base = problem(toy)
    y = drawn(toy, base, generator(1), {"e1": 0.9}, 0.3)
    there = base.measured(y)
    s = shrink(there, "e1")
    assert s is not None
    hold, _ = held_out(there.observations.rows)
    (h,) = (h for h in weigh(there.only(~hold)) if h.key == "e1")
    effects = {} if without else h.mean()

    def off(x: np.ndarray) -> np.ndarray:
        return toy._answer(Query(x, effects)).eta - y

    weighed = lambda x: np.concatenate([off(x)[~hold] / 0.002, (x - toy.start) / toy.spread])
    best = least_squares(weighed, toy.start, xtol=1e-14, ftol=1e-14).x
    expected = 100 * np.sqrt(np.mean(off(best)[hold] ** 2))
    got = s.least_squares_before_percent if without else s.least_squares_after_percent
    assert got == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_a_toggle_that_parts_twins_comes_first_and_does() -> None:
    toy = Toy(twin=True, size=0.02)
    toy.tilt["twin"] = 0.98 * toy.tilt["e0"]
    alone = diagnosed(toy, {"e0": 0.7}, 3)
    assert alone.verdict.kind == "undecided"
    words = [choice.what for choice in alone.choices if choice.gain > 0][:2]
    assert any(id in what for what in words for id in ("e0", "twin"))
    base = problem(toy, changes=(Toggle("e0", 0.0),))
    y = drawn(toy, problem(toy), generator(3), {"e0": 0.7}, 0.3)
    noise = generator(4).normal(0, 0.001, len(y))
    both = base.measured(np.concatenate([y, y - 0.7 * toy.g["e0"] + noise])).observations
    after = diagnose(toy, toy.rows, both, (Toggle("e0", 0.0),), base.assumed)
    assert after.verdict.kind == "named" and after.verdict.key == "e0" and after.rung == 4


@pytest.mark.parametrize("size", [0.003, 0.012])
def test_four_measurements_gain_what_half_the_scatter_does(size: float) -> None:
    """The gain of measuring all again, by the formula that the module states, without its code;
    of large effects what is beyond a distance of 40 gains nothing."""
    toy = Toy(effects=2, size=size)
    p = problem(toy, noise=0.01)
    sizes = {id: {id: 1.0} for id in ("e0", "e1")}
    likely = {"e0": 0.5, "e1": 0.3}

    def apart(noise: float) -> float:
        S = problem(toy, noise=noise).sigma
        inverse = np.linalg.inv(S)
        J = toy.J
        fit = np.linalg.solve(J.T @ inverse @ J + np.diag(toy.spread**-2.0), J.T @ inverse)
        off = toy.g["e0"] - toy.g["e1"]
        return float(2 * 0.5 * 0.3 * min(off @ (inverse - inverse @ J @ fit) @ off, 40.0))

    (again,) = [c for c in rank(p, np.zeros(3), likely, sizes, ()) if "all 4 times" in c.what]
    assert again.hours == 6.0 and 0.1 < apart(0.01) < apart(0.005)
    assert (apart(0.005) == 12.0) == (size > 0.01)
    assert again.gain == pytest.approx((apart(0.005) - apart(0.01)) / 6.0, rel=1e-3)


def test_an_anchor_is_exact_where_it_was_asked_and_absent_without_the_effect() -> None:
    toy = Toy(bend=0.3)
    bare = expand(toy, np.zeros(3))
    x = np.array([0.4, -0.3, 0.2])
    toy.bend = toy.bend * 1.5  # the model at hand departs from what was expanded
    found = anchored(bare, toy, {"e0": (0.6, x)})
    (answer,) = toy.answers([Query(x, {"e0": 0.6})])
    assert isinstance(answer, Answer)
    eta, J = found.plain(x)
    for e, wanted in ((0.6, answer), (0.0, None)):
        a, B, _ = found.nodes["e0"].at(np.array([e]))
        if wanted:
            assert eta + a[0] + B[0] @ x == pytest.approx(wanted.eta, abs=1e-9)
            assert J + B[0] == pytest.approx(wanted.jacobian, abs=1e-9)
        else:
            assert abs(a).max() == 0 and abs(B).max() == 0
    far, _, _ = found.nodes["e0"].at(np.array([1.0]))
    near, _, _ = bare.nodes["e0"].at(np.array([1.0]))
    assert abs(far - near).max() <= abs(found.nodes["e0"].anchor.shift).max() * 3  # type: ignore[union-attr]


def test_narrow_peaks_are_integrated() -> None:
    """An effect seen 300 times over: ln Z against 200001 points, the interval as narrow."""
    toy = Toy(size=0.3, bend=0.0, pressures=(240.0,), effects=1)
    toy.tilt["e0"] *= 0
    base = problem(toy)
    p = base.measured(toy.base + 0.4321 * toy.g["e0"])
    found = explain(p, ["e0"], 1.0)
    S = np.linalg.inv(p.sigma + toy.J @ toy.J.T)
    grid = (np.arange(200_001) + 0.5) / 200_001
    a = toy.g["e0"] @ S @ toy.g["e0"]
    ln = -a * (grid - 0.4321) ** 2 / 2
    _, ln_det = np.linalg.slogdet(p.sigma + toy.J @ toy.J.T)
    wanted = np.log(np.mean(np.exp(ln))) - (ln_det + len(p.places) * np.log(2 * np.pi)) / 2
    assert a > 1e3
    assert found.ln_evidence == pytest.approx(wanted, abs=0.02)
    assert found.mean()["e0"] == pytest.approx(0.4321, abs=1e-3)
    width = found.quantile("e0", 0.95) - found.quantile("e0", 0.05)
    assert width == pytest.approx(2 * 1.645 / np.sqrt(a), rel=0.15)


def test_the_section_map_finds_the_part_and_joins_what_looks_alike(chance: Chance) -> None:
    """With its softness within its sigma.

    False failures: 1e-7.
    """
    toy = Toy(size=0.01)
    random = np.random.default_rng(5)  # the tyre is one, its data are drawn
    shape = lambda: np.tile(random.normal(0, 0.3, len(LABELS)), 3)
    soft, other = shape(), shape()
    parts = [
        SectionPart("sidewall", soft, shape() / 10, ""),
        SectionPart("bead", 1.01 * soft, shape() / 10, ""),
        SectionPart("tread", other, shape() / 10, ""),
        SectionPart("nowhere", 0 * soft, 0 * soft, ""),
    ]
    base = problem(toy)
    y = drawn(toy, base, chance.random, {}, 0.3) + 0.05 * soft
    found = diagnose(
        toy, toy.rows, base.measured(y).observations, assumed=base.assumed, parts=lambda x: parts
    )
    best = found.parts[0]
    assert best.region in ("sidewall", "bead") and set(best.same_as) == {"sidewall", "bead"} - {
        best.region
    }
    chance.normal([(best.stiffness_percent - 5) / best.stiffness_sigma])
    (nothing,) = [p for p in found.parts if p.region == "nowhere"]
    assert nothing.evidence == 0 and nothing.stiffness_sigma == pytest.approx(20)
    assert 2 <= found.effective_rank <= 6


def test_a_pair_is_told_with_both_sizes() -> None:
    toy = Toy(effects=3, size=0.05)
    d = diagnosed(toy, {"e0": 0.8, "e1": 0.6}, 7)
    told = result(d)
    assert told["effect"] == "e0+e1" and set(told["parameters"]) == {"e0", "e1"}
    words = page(DiagnosedCase(d, (), False, (), (), toy), "tyre", "a.csv")  # type: ignore[arg-type]
    for size in told["parameters"].values():
        assert size["low"] < size["value"] < size["high"]
        number = f"{size['value']:.3g}"
        assert f"is {number}, 90 %" in words and f"{number} ({size['low']:.3g}" in words


def test_the_intervals_of_a_pair_cover(chance: Chance) -> None:
    """Each 90 % interval holds the truth, drawn from its prior, in 88 to 92 of 100 tyres.

    False failures: 2e-7.
    """
    toy = Toy(effects=2, bend=0.0)
    for id in toy.tilt:
        toy.tilt[id] = 0 * toy.tilt[id]
    base = problem(toy)
    inside: dict[str, list[bool]] = {"e0": [], "e1": []}
    for _ in range(30):
        truth = {id: chance.random.uniform(0, 1) for id in inside}
        there = base.measured(drawn(toy, base, chance.random, truth, 1.0))
        (pair,) = (h for h in weigh(there) if h.key == "e0+e1")
        for id, hits in inside.items():
            low, high = (pair.quantile(id, share) for share in (0.05, 0.95))
            hits.append(low <= truth[id] <= high)
    for hits in inside.values():
        chance.often(hits, 0.88, 0.92)


def test_the_result_is_plain_data_with_the_promised_keys() -> None:
    import json

    told = result(diagnosed(Toy(effects=3), {}, 7))
    json.dumps(told, allow_nan=False)
    assert {
        "verdict",
        "effect",
        "parameter",
        "probabilities",
        "candidate_set",
        "groups",
        "detectability",
        "gap",
        "section_map",
        "shrinkage",
        "rung",
        "bias_percent",
        "next_measurements",
    } <= set(told)
    assert {"p_value", "rms_percent", "by_family", "by_harmonic", "by_pressure"} <= set(told["gap"])
    assert set(told["gap"]["by_family"]) == {"in-plane", "lateral", "[0,0]"}
    assert set(told["bias_percent"]) == {"A", "B", "C"}
    assert {
        "held_out",
        "before_percent",
        "after_percent",
        "fraction",
        "low",
        "high",
        "placebo_95",
    } <= set(told["shrinkage"])
    assert sum(told["probabilities"].values()) == pytest.approx(1, abs=1e-4)
