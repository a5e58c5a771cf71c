"""The whole on a tyre in closed form: held-out data, the placebo, the next measurement, anchors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from tyrecal.report.diagnosis import page
from tyrecal.simulate.modes.label import Label
from tyrecal.simulate.modes.loaded import Member
from tyrecal.studies.diagnose.diagnosis import STAGES, Diagnosis, diagnose
from tyrecal.studies.diagnose.evidence import explain, grid, refit
from tyrecal.studies.diagnose.expansion import anchored, expand
from tyrecal.studies.diagnose.inverse_problem import Assumed, Toggle
from tyrecal.studies.diagnose.model import Answer, Query, Span
from tyrecal.studies.diagnose.observations import Observable
from tyrecal.studies.diagnose.regions import SectionPart
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.diagnose.several import weigh
from tyrecal.studies.diagnose.shrinkage import _placebo, held_out, shrink
from tyrecal.studies.diagnose.study import DiagnosedCase
from tyrecal.studies.diagnose.under_load import LoadedRow, UnderLoad

from ..chance import Chance, generator
from .toy import LABELS, Toy, drawn, problem

pytestmark = pytest.mark.numbers


def diagnosed(toy: Toy, effects: dict[str, float], seed: int, **keys: object) -> Diagnosis:
    base = problem(toy)
    y = drawn(toy, base, generator(seed), effects, 0.3)
    return diagnose(toy, toy.rows, base.measured(y).observations, assumed=base.assumed, **keys)  # type: ignore[arg-type]


def test_every_stage_is_told_once_and_in_order() -> None:
    told: list[str] = []
    diagnosed(Toy(effects=1), {"e0": 0.5}, 0, stage=told.append)
    assert told == list(STAGES)


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
    toy.spread = np.array([0.003, 0.01, 0.03])  # so that the bounds count
    base = problem(toy)
    y = drawn(toy, base, generator(1), {"e1": 0.9}, 0.03)
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


def test_an_anchor_is_exact_where_it_was_asked_and_absent_without_the_effect() -> None:
    toy = Toy(bend=0.3)
    bare = expand(toy, np.zeros(3))
    x = np.array([0.4, -0.3, 0.2])
    toy.bend = toy.bend * 1.5  # the model at hand departs from what was expanded
    found = anchored(bare, toy, [Query(x, {"e0": 0.6})])
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


def test_what_two_effects_do_together_is_asked() -> None:
    """Exact where they were asked, what each is alone where the other is absent; and of effects
    whose product shifts modes too, exact at all sizes up to there."""

    class Product(Toy):
        def _answer(self, point: Query) -> Answer:
            found = super()._answer(point)
            both = point.effects.get("e0", 0.0) * point.effects.get("e1", 0.0)
            return replace(found, eta=found.eta + 0.02 * both)

    toy, d = Product(effects=3, bend=0.0), np.array([0.2, -0.1, 0.1])
    bare = expand(toy, np.zeros(3))
    met = anchored(bare, toy, [Query(d, {"e0": 0.8, "e1": 0.5})])
    asked = replace(problem(toy), expansion=met)
    for e in ((0.8, 0.5), (0.4, 0.25), (0.8, 0.0), (0.0, 0.5)):
        effects = dict(zip(("e0", "e1"), e, strict=True))
        (answer,) = toy.answers([Query(d, effects)])
        assert isinstance(answer, Answer)
        at = {id: np.array([size]) for id, size in effects.items()}
        assert asked.predicted(at, d[None])[0] == pytest.approx(answer.eta, abs=1e-9)
    without = asked.added({"e0": np.array([0.8]), "e2": np.array([0.3])}, 1)[0]
    plain = replace(asked, expansion=bare).added({"e0": np.array([0.8]), "e2": np.array([0.3])}, 1)
    assert without == pytest.approx(plain[0])


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
    told = diagnosis_result(d).content()
    assert told["effect"] == "e0+e1" and set(told["parameters"]) == {"e0", "e1"}
    words = page(DiagnosedCase(d, (), False, {}, (), toy), "tyre", "a.csv")  # type: ignore[arg-type]
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


class OtherUnits(Toy):
    """The toy with effects counted in fortieths, and design variables in other units each."""

    effect, x = 40.0, np.array([2.0, 0.5, 1.5])

    def __init__(self, **keys: Any):
        super().__init__(**keys)
        self.spread = self.spread * self.x
        self.spans = {id: Span(0.0, self.effect) for id in self.spans}

    def _answer(self, point: Query) -> Answer:
        effects = {id: e / self.effect for id, e in point.effects.items()}
        found = super()._answer(Query(point.x / self.x, effects, point.constants))
        return replace(found, jacobian=found.jacobian / self.x)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_diagnosis_does_not_depend_on_units(seed: int) -> None:
    """Of effects and of design variables: the same probabilities, gap, errors held out and gains,
    and sizes in the other unit."""
    toys = [
        kind(effects=3, size=0.02, pressures=(200.0, 240.0), bend=0.0) for kind in (Toy, OtherUnits)
    ]
    for toy in toys:
        toy.spread = 0.4 * toy.spread  # so that the prior counts
    base = problem(toys[0])
    y = drawn(toys[0], base, generator(seed), {"e1": 0.4}, 0.5)
    shape = np.random.default_rng(5).normal(0, 0.3, (2, len(y)))
    parts = [SectionPart("a", shape[0], shape[1], ""), SectionPart("b", shape[1], shape[0], "")]
    one, other = (
        diagnosis_result(
            diagnose(
                toy,
                toy.rows,
                base.measured(y).observations,
                assumed=Assumed(form=0.001),
                parts=lambda x: parts,
                seed=seed,
            )
        ).content()
        for toy in toys
    )
    for told, scale, unit in ((one, 1.0, np.ones(3)), (other, OtherUnits.effect, OtherUnits.x)):
        for sizes in (told["parameter"], *told["parameters"].values()):
            for key in ("value", "low", "high"):
                sizes[key] /= scale
        for key in ("judged_at", "smallest_visible"):
            told[key] = {id: e if e is None else e / scale for id, e in told[key].items()}
        for by, width in zip(told["bias_percent"].values(), unit, strict=True):
            by |= {id: float(np.log1p(change / 100)) / width for id, change in by.items()}
    flat = [list(numbers(told)) for told in (one, other)]
    assert [place for place, _ in flat[0]] == [place for place, _ in flat[1]]
    values = [np.array([value for _, value in each]) for each in flat]
    assert len(values[0]) > 150
    assert values[1] == pytest.approx(values[0], rel=1e-4, abs=1e-6)


def numbers(told: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a result, and where it stands."""
    inner = told.items() if isinstance(told, dict) else enumerate(told)
    for key, value in inner:
        if isinstance(value, dict | list):
            yield from numbers(value, f"{place}.{key}")
        elif isinstance(value, int | float):
            yield f"{place}.{key}", float(value)


def test_the_placebo_is_what_tyres_without_an_effect_would_show() -> None:
    """Each drawn tyre by itself: the likeliest effect of the rows that are kept, at its likeliest
    size, lowers the error of those held out by R; 95 % of them show less."""
    toy = Toy(effects=2, size=0.02, pressures=(200.0, 240.0), bend=0.0)
    toy.tilt = {id: 200 * tilt for id, tilt in toy.tilt.items()}
    toy.spans["e1"] = Span(0.0, 0.7)
    p = problem(toy, assumed=Assumed(form=0.001, law=0.04))
    hold, _ = held_out(p.observations.rows)
    noise = np.random.default_rng(7).multivariate_normal(
        np.zeros(len(hold)), p.sigma, 200, method="cholesky"
    )
    kept, out = p.only(~hold), p.only(hold)
    shares = []
    for each in noise:
        there = kept.measured(kept.plain(np.zeros(3))[0] + each[~hold])
        before = each[hold] - out.plain(np.zeros(3))[1] @ refit(there, {}, 1).d[0]
        best = max((explain(there, [id], 1.0) for id in toy.g), key=lambda h: h.ln_evidence)
        assert best.fitted is not None
        e, d = {best.key: best.values[best.key][[best.best]]}, best.fitted.d[best.best]
        shift, tilt, *_ = out.added(e, 1)
        after = each[hold] - shift[0] - (out.plain(np.zeros(3))[1] + tilt[0]) @ d
        shares.append(1 - np.sqrt(np.mean(after**2) / np.mean(before**2)))
    found = _placebo(p, hold, np.random.default_rng(7))
    assert found == pytest.approx(np.quantile(shares, 0.95), rel=1e-6)


def test_sizes_on_the_grid_have_a_density_of_one_over_the_range() -> None:
    """Of polynomials the weighted sum is the mean over the range, wherever that lies."""
    nodes = expand(Toy(effects=1), np.zeros(3)).nodes["e0"]
    for low, high in ((0.0, 1.0), (-3.0, 1.0), (2.0, 7.0)):
        e, ln = grid(replace(nodes, reach=(low, high)))
        mean = (high**4 - low**4) / 4 / (high - low)
        assert np.exp(ln) @ e**3 == pytest.approx(mean)
        assert low < e.min() and e.max() < high and len(e) == 25


def test_the_result_says_what_was_found() -> None:
    d = diagnosed(Toy(effects=3, pressures=(200.0, 240.0)), {"e1": 0.8}, 7)
    told = diagnosis_result(d).content()
    assert [(g["name"], g["p_value"], g["holm"]) for g in told["gap"]["groups"]] == [
        (g.name, g.p_value, g.corrected) for g in d.gap.groups
    ]
    assert any(g["holm"] > g["p_value"] for g in told["gap"]["groups"])
    by = {**told["gap"]["by_family"], **told["gap"]["by_harmonic"], **told["gap"]["by_pressure"]}
    assert by == {g.name: g.rms_percent for g in d.gap.groups}
    rows = told["gap"]["residuals"]
    assert [row["percent"] for row in rows] == pytest.approx(100 * d.gap.residuals)
    assert [row["sigma_percent"] for row in rows] == pytest.approx(100 * d.gap.spread)
    assert told["shrinkage"] == {
        name: getattr(d.shrinkage, name)
        for name in d.shrinkage.__dataclass_fields__  # type: ignore[union-attr]
    }
    shares = list(told["probabilities"].values())
    assert shares == sorted(shares, reverse=True) and {"none", "outside"} <= set(
        told["probabilities"]
    )
    kept = {key for key, p in d.probabilities.items() if p > 1e-6}
    assert set(told["probabilities"]) == kept | {"none", "outside"} != set(d.probabilities)


def test_the_result_says_what_was_measured_under_load() -> None:
    """By load where all tyres have an answer, every row with what each tyre is off by."""
    d = diagnosed(Toy(effects=3), {}, 7)
    member = Member(Label(2, 0), "symmetric")
    area = LoadedRow("contact_area_m2", None, 240.0, 3e3, 0.01, 1e-4, {"none": 0.03, "e1": -0.01})
    mode = LoadedRow("frequency_Hz", member, 220.0, 1e3, 80.0, 0.5, {"none": 0.02, "e1": 0.0})
    lost = LoadedRow("contact_area_m2", None, 240.0, 2e3, 0.02, 1e-4, {"none": 0.5})
    rows = (area, mode, lost)
    told = diagnosis_result(d, UnderLoad(rows, ("none", "e1"), ("e1, 240 kPa: no",))).content()
    assert list(told["gap"]["by_load"].items()) == [
        ("1000", pytest.approx(2.0)),
        ("3000", pytest.approx(3.0)),
    ]
    under = told["under_load"]
    assert under["effect"] == "e1" and under["failed"] == ["e1, 240 kPa: no"]
    assert under["calibrated_rms_percent"] == pytest.approx(100 * np.hypot(0.03, 0.02) / 2**0.5)
    assert under["effect_rms_percent"] == pytest.approx(1 / 2**0.5)
    assert [row["calibrated_percent"] for row in under["rows"]] == pytest.approx([3.0, 2.0, 50.0])
    assert [row["effect_percent"] for row in under["rows"]] == [-1.0, 0.0, None]
    assert [row["mode"] for row in under["rows"]] == [None, str(member), None]
    for row, own in zip(under["rows"], rows, strict=True):
        names = ("quantity", "pressure_kPa", "load_N", "measured", "sigma")
        assert [row[name] for name in names] == [
            own.quantity,
            own.pressure_kPa,
            own.load_N,
            own.value,
            own.sigma,
        ]
    alone = diagnosis_result(d, UnderLoad(rows[2:], ("none",), ())).content()["under_load"]
    assert alone["effect"] is None and alone["effect_rms_percent"] is None
    assert alone["rows"][0]["effect_percent"] is None
    assert alone["calibrated_rms_percent"] == pytest.approx(50.0)
    plain = diagnosis_result(d).content()
    assert plain["under_load"] is None and plain["gap"]["by_load"] == {}


def test_the_result_is_plain_data_with_the_promised_keys() -> None:
    import json

    told = diagnosis_result(diagnosed(Toy(effects=3), {}, 7)).content()
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
