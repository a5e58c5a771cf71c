"""A planned test: chances against the diagnosis itself, the order, and widths in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.studies.diagnose.next_measurement import COST_HOURS, STEP_HOURS, cost_hours
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.plan.chance import FOUND, NONE, LinearDiagnosis, shares
from tyrecal.studies.plan.laboratory import Item, Laboratory
from tyrecal.studies.plan.order import order
from tyrecal.studies.plan.study import _widths

from ..chance import generator
from ..diagnose.toy import flat, problem

pytestmark = pytest.mark.numbers


def laboratory(noise: float = 0.001, size: float = 0.02) -> Laboratory:
    """A toy that may be measured at three pressures, each an hour."""
    toy = flat(effects=4, size=size)
    base = problem(toy, noise=noise)
    item = np.array([f"{p:g} kPa" for _, p in toy.rows])
    menu = {name: Item(name, 1.0, float(name.split()[0])) for name in dict.fromkeys(item.tolist())}
    return Laboratory(base, item, menu, 240.0, False)


def test_probabilities_are_those_of_the_diagnosis() -> None:
    """A tyre that is linear, without scatter by chance: the same integrals by the same rule."""
    lab = laboratory()
    linear = lab.linear
    tyres = linear.draw(4, generator(3))
    rows = lab.rows(["160 kPa", "240 kPa"])
    p = linear.probabilities(tyres.y, rows)
    base = lab.problem
    keep = np.isin(np.arange(len(base.places)), rows)
    for y, stated in zip(tyres.y, p, strict=True):
        measured = base.measured(base.observations.y + y).only(keep)
        wanted = probabilities(weigh_hypotheses(measured, pairs=False))
        assert dict(zip(linear.keys, stated, strict=True)) == pytest.approx(wanted, abs=0.03)


def test_a_pair_that_an_effect_holds_apart_shows_it() -> None:
    """Its distance is a row of its own, with the scatter of both members and the tyre's own."""
    toy = flat(effects=1, size=0.0)
    toy.splits["e0"] = np.full(len(toy.rows), 0.05)
    base = problem(toy)
    apart = np.full(len(toy.rows), 0.003)
    seen = replace(base.observations, split=0 * apart, split_scatter=apart)
    shown, hidden = (
        LinearDiagnosis(replace(base, observations=o)) for o in (seen, base.observations)
    )
    for linear, least, most in ((shown, 0.9, 1.0), (hidden, 0.0, 0.1)):
        tyres = linear.draw(20, generator(0))
        chances = shares(tyres, linear.found(tyres, np.arange(len(linear.sigma))))
        assert least <= chances["e0"] <= most
    n = len(toy.rows)
    own = shown.problem.assumed.split**2
    assert np.diag(shown.sigma)[n:] == pytest.approx(np.full(n, own + 0.003**2))


def test_no_measurement_finds_nothing_and_more_find_more() -> None:
    """Sizes far above all scatter are found with certainty, and a sound tyre is not accused."""
    lab = laboratory(noise=5e-4, size=0.05)
    tyres = lab.linear.draw(10, generator(1))
    chance = lambda done: shares(tyres, lab.linear.found(tyres, lab.rows(done)))
    none, every = chance([]), chance([*lab.menu])
    assert all(none[id] == 0 for id in none if id != NONE) and none[NONE] == 1
    assert every[NONE] == 1 and all(every[id] > FOUND for id in every)


def test_the_order_keeps_within_the_hours_and_gains_with_each_step() -> None:
    lab = laboratory(size=0.006)
    tyres = lab.linear.draw(12, generator(2))
    whole = order(lab, tyres)
    assert len(set(whole)) == len(whole) and order(lab, tyres, 1.0) == whole[:1]
    assert order(lab, tyres, 0.5) == []
    with_effect = tyres.only(np.array(tyres.keys) != NONE)
    chances = [
        float(lab.linear.found(with_effect, lab.rows(whole[:k])).mean())
        for k in range(len(whole) + 1)
    ]
    assert len(whole) > 1 and chances[-1] > chances[1] > chances[0] == 0
    singles = {n: lab.linear.found(with_effect, lab.rows([n])).mean() for n in lab.menu}
    assert chances[1] == max(singles.values())


def test_pressures_are_a_step_apart_unless_a_user_names_them() -> None:
    lab = laboratory()
    lab.menu["200 kPa"] = Item("", 1.0, 200.0)  # type: ignore[index]
    assert "200 kPa" not in lab.offered(["240 kPa"])
    assert "200 kPa" in replace(lab, any_pressure=True).offered(["240 kPa"])


def test_widths_are_those_of_the_linear_fit() -> None:
    """(J^T Sigma^-1 J + Sx^-2)^-1 for the variables; J Sx^2 J^T + the model's error before."""
    lab = laboratory()
    lab = replace(lab, item=np.where(lab.item == "240 kPa", "mount", lab.item))
    menu = {**lab.menu, "mount": Item("", 3.0)}
    lab = replace(lab, menu=menu)
    rows = lab.rows(["160 kPa"])
    J, S = lab.linear.jacobian[rows], lab.linear.sigma[np.ix_(rows, rows)]
    wanted = np.linalg.inv(J.T @ np.linalg.inv(S) @ J + np.diag(lab.problem.spread**-2.0))
    of_x, of_f = _widths(lab, ["160 kPa"])
    assert of_x == pytest.approx(np.sqrt(np.diag(wanted)), rel=1e-5)
    before = _widths(lab, [])
    assert before[0] == pytest.approx(lab.problem.spread) and (of_f < before[1]).all()
    again = _widths(lab, ["mount"])[1]
    scatter = lab.problem.observations.scatter[lab.item == "mount"]
    assert (again < scatter).all()  # of the tyre itself, without that of a measurement


def test_one_model_of_costs() -> None:
    """A step that is dearer makes all dearer that need it, and nothing else."""
    dearer = cost_hours({**STEP_HOURS, "mount": STEP_HOURS["mount"] + 1})
    changed = {name for name, hours in dearer.items() if hours != COST_HOURS[name]}
    assert changed == {"mount", "clamp", "toggle"}
    assert all(dearer[name] == COST_HOURS[name] + 1 for name in changed)
