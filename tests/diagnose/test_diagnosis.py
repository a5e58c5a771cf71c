"""The whole on a tyre in closed form: its stages, twins that a toggle parts, the section, units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tyrecal.studies.diagnose.diagnosis import STAGES, Diagnosis, diagnose
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.inference.inverse_problem import Assumed, Toggle
from tyrecal.studies.inference.model import Answer, EffectRange, Query
from tyrecal.studies.inference.regions import SectionPart

from ..chance import Chance, generator
from .toy import LABELS, Toy, drawn, problem

pytestmark = pytest.mark.numbers


def diagnosed(toy: Toy, effects: dict[str, float], seed: int, **keys: object) -> Diagnosis:
    base = problem(toy)
    y = drawn(toy, base, generator(seed), effects, 0.3)
    return diagnose(toy, toy.rows, base.measured(y).observations, assumed=base.assumed, **keys)  # type: ignore[arg-type]


def test_every_stage_is_told_once_and_in_order() -> None:
    stages: list[str] = []
    diagnosis = diagnosed(Toy(effects=1), {"e0": 0.5}, 0, stage=stages.append)
    assert stages == list(STAGES)
    assert repr(diagnosis) == f"Diagnosis({diagnosis.verdict.kind}: {diagnosis.verdict.words})"


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


@pytest.mark.slow
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
    diagnosis = diagnose(
        toy, toy.rows, base.measured(y).observations, assumed=base.assumed, parts=lambda x: parts
    )
    best = diagnosis.parts[0]
    assert best.region in ("sidewall", "bead") and set(best.same_as) == {"sidewall", "bead"} - {
        best.region
    }
    chance.normal([(best.stiffness_percent - 5) / best.stiffness_sigma])
    (nothing,) = [p for p in diagnosis.parts if p.region == "nowhere"]
    assert nothing.evidence == 0 and nothing.stiffness_sigma == pytest.approx(20)
    assert 2 <= diagnosis.effective_rank <= 6


class OtherUnits(Toy):
    """The toy with effects counted in fortieths, and design variables in other units each."""

    effect, x = 40.0, np.array([2.0, 0.5, 1.5])

    def __init__(self, **keys: Any):
        super().__init__(**keys)
        self.spread = self.spread * self.x
        self.ranges = {id: EffectRange(0.0, self.effect) for id in self.ranges}

    def _answer(self, point: Query) -> Answer:
        effects = {id: e / self.effect for id, e in point.effects.items()}
        answer = super()._answer(Query(point.x / self.x, effects, point.constants))
        return replace(answer, jacobian=answer.jacobian / self.x)


@pytest.mark.parametrize("seed", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_a_diagnosis_does_not_depend_on_units(seed: int) -> None:
    """Units of effects and of design variables change no probability, gap, error held out or gain;
    sizes are in the other unit."""
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
    for content, scale, unit in ((one, 1.0, np.ones(3)), (other, OtherUnits.effect, OtherUnits.x)):
        for sizes in (content["parameter"], *content["parameters"].values()):
            for key in ("value", "low", "high"):
                sizes[key] /= scale
        for key in ("judged_at", "smallest_visible"):
            content[key] = {id: e if e is None else e / scale for id, e in content[key].items()}
        for by, width in zip(content["bias_percent"].values(), unit, strict=True):
            by |= {id: float(np.log1p(change / 100)) / width for id, change in by.items()}
    flat = [list(numbers(content)) for content in (one, other)]
    assert [place for place, _ in flat[0]] == [place for place, _ in flat[1]]
    values = [np.array([value for _, value in each]) for each in flat]
    assert len(values[0]) > 150
    assert values[1] == pytest.approx(values[0], rel=1e-4, abs=1e-6)


def numbers(data: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a result, and where it stands."""
    inner = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in inner:
        if isinstance(value, dict | list):
            yield from numbers(value, f"{place}.{key}")
        elif isinstance(value, int | float):
            yield f"{place}.{key}", float(value)
