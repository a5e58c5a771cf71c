"""Next measurements: the menu, gains by their formula, information."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.integrate import trapezoid

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.next_measurement import (
    CHECKED,
    CandidateRows,
    OtherStates,
    offered_kPa,
    rank,
)
from tyrecal.studies.inference.inverse_problem import Toggle
from tyrecal.studies.inference.model import Answer, EffectRange, Query
from tyrecal.studies.inference.observations import Observable
from tyrecal.studies.inference.separability import separate

from ..chance import generator
from .toy import LABELS, Sloped, Toy, problem

pytestmark = pytest.mark.numbers

Array = np.ndarray


def test_the_menu_of_measurements() -> None:
    """The menu with its prices: pressures far from those measured, the next harmonics, the mass
    where it is not known; a likely effect switched off, sources by themselves."""
    toy = Toy(effects=3, pressures=(200.0, 250.0))
    p = problem(toy)
    sizes = {id: {id: np.array([0.4, 0.6])} for id in toy.ranges}
    likely = {"none": 0.4, "e0": 0.3, "e1": 0.294, "e2": 0.006, "outside": 0.0}
    toy.ranges["e0"] = EffectRange(0, 1, toggle="take e0 out")
    p = replace(p, ranges=toy.ranges)
    rows: list = []

    def further(wanted: list) -> Any:
        rows.extend(wanted)
        count, random = len(wanted), generator("further")
        zero, J = np.zeros(count), random.normal(size=(count, 3))
        answer = Answer(zero, J, zero, np.zeros((count, 2)))
        by = lambda point: 0.1 * len(point.effects) * random.normal(size=count)
        moved = lambda point: replace(answer, eta=by(point))
        answers = lambda points: [answer, *map(moved, points[1:])]
        return SimpleNamespace(answers=answers, sloped_at_0=())

    candidates = rank(
        p,
        np.zeros(3),
        likely,
        sizes,
        ("rubber_density", "section gauge 1"),
        OtherStates(further, 240.0),
    )
    assert {c.what: c.hours for c in candidates} == {
        "measure separately: rubber density": 1.0,
        "cut the tyre and measure its section": 8.0,
        "dismount the tyre, mount it again and repeat all measurements": 3.0,
        "take e0 out": 4.0,
        "measure again without e1": 4.0,
        "measure again without e2": 4.0,
        "measure the same modes at 100 kPa": 1.0,
        "measure the same modes at 320 kPa": 1.0,
        "measure [5,0] and [5,1] too": 1.0,
        "weigh the tyre": 0.1,
    }
    assert [c.gain for c in candidates] == sorted((c.gain for c in candidates), reverse=True)
    assert all(c.gain > -1e-9 for c in candidates)
    few = rank(p, np.zeros(3), {**likely, "e1": 0.295, "e2": 0.005}, sizes, ())
    assert not any("e2" in c.what for c in few)
    assert rank(p, np.zeros(3), {"e0": 0.995, "none": 0.005}, sizes, ()) == []
    assert rank(p, np.zeros(3), {"e0": 0.5, "strange": 0.5}, sizes, ()) == []


def test_what_further_rows_gain_from_an_effect_whose_slope_at_0_is_known() -> None:
    """It is not asked: its slope there, bent as in the rows that it was asked for; those of the
    others as they are asked."""
    toy = Sloped(2, at_0=True, span=EffectRange(0.0, 1.0))
    toy.curve = 2e-3 * Polynomial([0.0, 1.0, -0.3])
    toy.ranges["e1"], toy.g["e1"] = EffectRange(0.0, 1.0), np.full(len(toy.rows), 0.001)
    toy.tilt["e1"], toy.splits["e1"] = np.zeros((len(toy.rows), 3)), np.zeros(len(toy.rows))
    p = problem(toy)
    likely = {"none": 0.4, "e0": 0.3, "e0+e1": 0.3}
    sizes = {"e0": {"e0": np.array([0.5])}, "e0+e1": {"e0": np.array([1.0]), "e1": np.array([0.5])}}
    queries: list[Query] = []

    def ranked(model: Any) -> float:
        candidates = rank(
            p, np.zeros(3), likely, sizes, (), OtherStates(lambda rows: model(len(rows)), 240.0)
        )
        return next(c.gain for c in candidates if "[5,0]" in c.what)

    def answered(count: int, straight: bool) -> Any:
        zero, J = np.zeros(count), np.tile([0.1, 0.2, 0.3], (count, 1))

        def answer(point: Query) -> Answer:
            queries.append(point)
            e0, e1 = (point.effects.get(id, 0.0) for id in ("e0", "e1"))
            eta = zero + 3 * toy.curve(e0) + 0.004 * e1
            slopes = dict.fromkeys(point.slopes, zero + 3 * toy.curve.deriv()(0.0))
            return Answer(eta, J, zero, np.zeros((count, 2)) if point.constants else None, slopes)

        known = ("e0",) if straight else ()
        return SimpleNamespace(answers=lambda q: [*map(answer, q)], sloped_at_0=known)

    whole = ranked(lambda count: answered(count, False))
    assert any(q.effects.get("e0") for q in queries)
    queries.clear()
    assert ranked(lambda count: answered(count, True)) == pytest.approx(whole, rel=1e-9)
    assert [dict(q.effects) for q in queries] == [{}, {"e1": 0.5}]
    assert queries[0].slopes == ("e0",) and queries[0].constants


@pytest.mark.parametrize("off", [0.0, 1e-15, 0.1])
def test_what_a_further_row_gains_from_an_effect_of_either_sign(off: float) -> None:
    """As if each size were evaluated, also if their mean is 0 or off by rounding, where the effect
    shows nothing that could be scaled to the other sizes."""
    toy = Toy(effects=1, pressures=(240.0,))
    sizes, likely = np.array([-0.8, 0.8 + off]), {"none": 0.6, "e0": 0.4}

    def further(rows: list) -> Any:
        zero, J = np.zeros(len(rows)), np.zeros((len(rows), 3))
        answer = lambda q: Answer(7.1 + 0.01 * q.effects.get("e0", zero), J, zero, J[:, :2])
        return SimpleNamespace(answers=lambda queries: [*map(answer, queries)], sloped_at_0=())

    further_rows = OtherStates(further, 240.0)
    ranked = rank(problem(toy), np.zeros(3), likely, {"e0": {"e0": sizes}}, (), further_rows)
    gain = next(c.gain * c.hours for c in ranked if c.what == "weigh the tyre")
    shifts = {"none": np.zeros((1, 1)), "e0": 0.01 * sizes[:, None]}  # of ln mass, to 0.005
    alone = CandidateRows(np.array([[0.005**2]]), np.zeros((1, 1)), shifts)
    assert gain == pytest.approx(alone.information(0, likely, np.ones(1)), rel=1e-3)
    assert gain > 0.03


def informed(p: Sequence[float], squared: Array) -> float:
    """The bound of information on explanations of one size each, squares of distances apart."""
    share = np.array(p) / sum(p)
    return float(-share @ np.log(np.exp(-squared / 8) @ share))


def test_the_gains_of_what_is_switched_and_checked_by_their_formula() -> None:
    """A run more without e0, and a source of error at a quarter of its deviation: further data tell
    what all of them tell less what the first did."""
    toy = Toy(effects=2, size=0.003, bend=0.0, pressures=(240.0,))
    toy.tilt = {id: 0 * tilt for id, tilt in toy.tilt.items()}
    p = problem(toy)
    sizes, likely = {id: {id: np.ones(1)} for id in ("e0", "e1")}, {"e0": 0.5, "e1": 0.3}
    candidates = {c.what: c for c in rank(p, np.zeros(3), likely, sizes, toy.sources)}

    def apart(S: Array, J: Array, off: Array) -> float:
        whole = S + J @ np.diag(toy.spread**2) @ J.T
        return float(off @ np.linalg.inv(whole) @ off)

    def bound(squared: float) -> float:
        return informed((0.5, 0.3), squared * (1 - np.eye(2)))

    off = toy.g["e0"] - toy.g["e1"]
    now = apart(p.sigma, toy.J, off)
    left = CHECKED**2 / (1 + CHECKED**2)  # of its variance
    S = p.sigma - (1 - left) * np.outer(toy.constants[:, 1], toy.constants[:, 1])
    checked = candidates["measure separately: gauge"]
    assert checked.gain == pytest.approx(bound(apart(S, toy.J, off) - now), rel=1e-6)
    both = problem(toy, changes=(Toggle("e0", 0.0),))
    twice = np.vstack([toy.J, toy.J])
    for words, moved, hours in (
        ("measure again without e0", -toy.g["e1"], 4.0),
        ("dismount the tyre, mount it again and repeat all measurements", off, 3.0),
    ):
        squared = apart(both.sigma, twice, np.concatenate([off, moved])) - now
        assert candidates[words].gain == pytest.approx(bound(squared) / hours, rel=1e-6)


def test_information_is_none_of_what_is_known_and_at_most_what_is_open() -> None:
    """Beside the whole integral of two explanations, a normal distribution each, it is a lower
    bound; it grows with what is measured; and a reading that shows no effect tells nothing."""
    open_ = -0.6 * np.log(0.6) - 0.4 * np.log(0.4)
    y, before = np.linspace(-9, 29, 20001), 0.0
    for off in (1e-6, 0.5, 1.0, 2.0, 4.0, 8.0, 20.0):
        shifts = {"a": np.zeros((1, 2)), "b": np.array([[0.0, off]])}
        one = CandidateRows(np.eye(2), np.zeros((2, 1)), shifts)
        gain = one.information(1, {"a": 0.6, "b": 0.4}, np.ones(1))
        normal = lambda m: np.exp(-((y - m) ** 2) / 2) / np.sqrt(2 * np.pi)
        both = 0.6 * normal(0) + 0.4 * normal(off)
        left = lambda p, both=both: -p * np.log(np.maximum(p / both, 1e-300))
        rest = trapezoid(left(0.6 * normal(0)) + left(0.4 * normal(off)), y)
        assert before <= gain <= open_ - rest + 1e-9
        before = gain
    assert gain == pytest.approx(open_, rel=1e-9)
    known = CandidateRows(
        np.array([[1.0, 1.0], [1.0, 1.0 + 1e-9]]),
        np.zeros((2, 1)),
        shifts | {"b": np.array([[20.0, 20.0]])},
    )
    assert abs(known.information(1, {"a": 0.6, "b": 0.4}, np.ones(1))) < 1e-9
    wide = {"a": np.zeros((7, 2)), "b": np.linspace([0, 0], [0, 9.0], 7)}
    spread = CandidateRows(np.eye(2), np.zeros((2, 1)), wide | {"a": wide["b"]})
    assert abs(spread.information(1, {"a": 0.6, "b": 0.4}, np.ones(1))) < 1e-9  # alike in both


def test_tools_of_a_laboratory_are_offered_for_what_they_show() -> None:
    """The rim's width at an effect of the rim; a clamp without all that gives way; helium for air;
    and the one that shows the likelier explanation first."""
    toy = Toy(effects=5, pressures=(240.0,))
    names = dict(
        zip(
            toy.g,
            ("rim_width", "spindle_tilt", "wheel_free", "cavity_air", "belt_angle"),
            strict=True,
        )
    )
    for each in (toy.g, toy.tilt, toy.ranges, toy.splits):
        for old, new in names.items():
            each[new] = each.pop(old)
    p = problem(toy)
    sizes = {id: {id: np.array([0.4, 0.5, 0.6])} for id in toy.ranges}
    likely = {"none": 0.4, "rim_width": 0.2, "spindle_tilt": 0.15, "wheel_free": 0.15}
    candidates = rank(p, np.zeros(3), likely, sizes, ())
    assert {c.what: c.hours for c in candidates} == {
        "measure the rim between its flanges": 0.2,
        "clamp the rim rigidly in place of the spindle and measure again": 3.0,
        "dismount the tyre, mount it again and repeat all measurements": 3.0,
    }
    assert "rim" in candidates[0].what
    air = rank(p, np.zeros(3), {"none": 0.5, "cavity_air": 0.3, "belt_angle": 0.2}, sizes, ())
    assert {c.what: c.hours for c in air} == {
        "cut the tyre and measure its section": 8.0,
        "inflate with helium and measure again": 1.0,
        "dismount the tyre, mount it again and repeat all measurements": 3.0,
    }
    assert all(c.gain > 0 for c in (*candidates, *air))


def test_detectabilities_and_distances_by_their_formula() -> None:
    """Shifts at the sizes at which effects are judged, in the metric P."""
    toy = Toy(effects=3, size=0.02, bend=0.0, pressures=(240.0,))
    toy.tilt = {id: 0 * tilt for id, tilt in toy.tilt.items()}
    p = problem(toy)
    P = np.diag(generator("metric").uniform(1e5, 4e5, len(p.places)))
    sizes = {"e0": 0.5, "e1": 0.75}  # e2 has none: it is judged at full size
    separability = separate(p, P, sizes)
    at = {**sizes, "e2": 1.0}
    g = np.array([at[id] * toy.g[id] for id in separability.ids])
    assert separability.sizes == pytest.approx(at)
    assert [separability.lambdas[id] for id in separability.ids] == pytest.approx(
        np.diag(g @ P @ g.T)
    )
    whole = [toy.g[id] @ P @ toy.g[id] for id in separability.ids]
    assert [separability.full[id] for id in separability.ids] == pytest.approx(whole)
    grid = np.linspace(0, 1, 81)
    for i, a in enumerate(separability.ids):
        for j, b in enumerate(separability.ids):
            off = grid[:, None] * toy.g[b] - at[a] * toy.g[a]
            wanted = np.einsum("qn,nm,qm->q", off, P, off).min() if i != j else 0.0
            assert separability.distances[i, j] == pytest.approx(wanted)


def test_the_gains_of_further_rows_by_their_formula() -> None:
    """Two more modes at the scatter of the others, or the mass to half a per cent, with form,
    constants and what an effect does there."""
    toy = Toy(effects=2, size=0.003, bend=0.0, pressures=(240.0,))
    toy.tilt = {id: 0 * tilt for id, tilt in toy.tilt.items()}
    p = problem(toy)
    p = replace(p, observations=replace(p.observations, scatter=np.linspace(1e-3, 3e-3, 9)))
    sizes = {id: {id: np.array([0.5])} for id in ("e0", "e1")}
    likely = {"e0": 0.4, "e1": 0.3, "none": 0.2}
    random = generator("rows")
    eta, J, c = random.normal(size=50), random.normal(size=(50, 3)), random.normal(size=(50, 2))
    moved = {"e0": random.normal(0, 0.002, 50), "e1": random.normal(0, 0.002, 50)}
    rows: list = []

    def answer(point: Query) -> Answer:
        n = slice(0, len(rows))
        shift = sum((e * moved[id][n] for id, e in point.effects.items()), np.zeros(len(rows)))
        own = 0.003 * c[n] if point.constants else None
        return Answer(eta[n] + shift, J[n], np.zeros(len(rows)), own)

    def further(wanted: list) -> Any:
        rows.extend(wanted)
        answers = lambda points: [answer(point) for point in points]
        return SimpleNamespace(answers=answers, sloped_at_0=())

    candidates = {
        c.what: c for c in rank(p, np.zeros(3), likely, sizes, (), OtherStates(further, 240.0))
    }
    assert len(candidates) == 8  # repeats, two toggles, 100, 160 and 320 kPa, harmonics, the mass
    assert candidates.keys() > {
        "measure the same modes at 160 kPa",
        "measure the same modes at 320 kPa",
    }

    def apart(at: list[int], form: float) -> Array:
        whole = np.vstack([toy.J, J[at]])
        constants = np.vstack([toy.constants, 0.003 * c[at]])
        noise = [*np.linspace(1e-3, 3e-3, 9), *(2e-3 if rows[i][0] else 0.005 for i in at)]
        sizes = np.array([0.001] * 9 + [form] * len(at))
        same = np.eye(len(whole))
        for k, i in enumerate(at):
            if rows[i][0] in LABELS:
                mode = LABELS.index(rows[i][0])
                same[9 + k, mode] = same[mode, 9 + k] = np.exp(
                    -(np.log(rows[i][1] / 240.0) ** 2) / (2 * 0.54**2)
                )
        S = np.diag(np.square(noise)) + same * np.outer(sizes, sizes) + constants @ constants.T
        S = S + 1e-12 * np.eye(len(S)) + whole @ np.diag(toy.spread**2) @ whole.T
        g = {id: 0.5 * np.append(toy.g[id], moved[id][at]) for id in moved}
        g["none"] = np.zeros(len(whole))
        off = lambda a, b: (g[a] - g[b]) @ np.linalg.inv(S) @ (g[a] - g[b])
        return np.array([[off(a, b) for b in likely] for a in likely])

    now = apart([], 0.001)
    for what, hours, at, form in (
        ("weigh the tyre", 0.1, [rows.index((None, 0.0))], 0.0),
        (
            "measure [5,0] and [5,1] too",
            1.0,
            [rows.index((Label(5, m), 240.0)) for m in (0, 1)],
            0.001,
        ),
        (
            "measure the same modes at 320 kPa",
            1.0,
            [rows.index((label, 320.0)) for label in sorted(LABELS, key=str)],
            0.001,
        ),
    ):
        gain = informed(list(likely.values()), apart(at, form) - now) / hours
        assert candidates[what].gain == pytest.approx(gain, rel=1e-6), what


def test_what_is_not_asked_twice_or_has_no_answer_is_not_offered() -> None:
    """Pressures nearer than a quarter of the tyre's own to one measured; the mass where it is
    known; nothing where the model fails; ten explanations at most."""
    toy = Toy(effects=12, pressures=(220.0, 260.0))
    p = problem(toy)
    sizes = {id: {id: np.array([0.5])} for id in toy.ranges}
    likely = {id: 0.07 + 0.001 * i for i, id in enumerate(sizes)}
    requests: list = []

    def further(wanted: list) -> Any:
        requests.append(wanted)
        return SimpleNamespace(answers=lambda q: [ValueError("no")] * len(q), sloped_at_0=())

    words = [c.what for c in rank(p, np.zeros(3), likely, sizes, (), OtherStates(further, 240.0))]
    assert sorted(what for what in words if "without" in what) == [
        *(f"measure again without e{i}" for i in (10, 11, *range(2, 10)))
    ]
    assert len(words) == 11  # and mounted again
    (rows,) = requests
    assert {pressure for _, pressure in rows} == {100.0, 160.0, 320.0, 220.0, 260.0, 0.0}
    o = p.observations
    weighed = replace(
        p, observations=replace(o, rows=(*o.rows[:-1], Observable("mass_kg", None, 0.0)))
    )
    rank(weighed, np.zeros(3), likely, sizes, (), OtherStates(further, 240.0))
    assert (None, 0.0) not in requests[1]


def test_pressures_that_are_offered_are_the_tyres() -> None:
    """A car's and a truck's, a quarter of its own apart from all that was measured, and none that
    it may not bear."""
    assert offered_kPa(240.0, []) == [100, 160, 200, 240, 280, 320]
    assert offered_kPa(240.0, [160, 240, 320]) == [100]
    assert offered_kPa(830.0, []) == [330, 550, 690, 830, 870, 910]
    assert offered_kPa(830.0, [600, 830]) == [330]
