"""Agreement of modes, sensitivities, inflation and a press on the road about stability."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.errors import RunFailed

from tests.studies.wrinkles import by_size, with_compression
from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.load import load_case

CASES = Path(__file__).parents[2] / "cases"
FLAT_BELTS = {"rebar_layers.belt_1.angle_deg": 66.0, "rebar_layers.belt_2.angle_deg": 114.0}


@cache
def passenger(bears_compression: bool) -> LoadedCase:
    """A 205/55R16 by its size code."""
    return with_compression(with_level(by_size("205/55R16"), "coarse"), bears_compression)


def failure(case: LoadedCase, pressed: bool, **numbers: float) -> str:
    """Reason why the bundled solver fails; "" if it does not."""
    design = TyreDesign(case).at({**FLAT_BELTS, **numbers})
    texts = Decks(design, loads_N=(500.0,) if pressed else ()).texts("abaqus")
    name = "press" if pressed else "modes"
    jobs = {key.removesuffix(".inp"): text for key, text in texts.items()}
    job = Job(Deck(jobs, name, "inflate"), Request(harmonics=[0]))
    try:
        job.press() if pressed else job.run()
    except RunFailed as failed:
        assert failed.cause == "unstable"
        return str(failed)
    return ""


def test_modes_and_road_refuse_the_same_tyre_in_the_same_words() -> None:
    """Belts 24 degrees from the circumference compress a carcass that bears compression."""
    modes, road = (failure(passenger(True), pressed) for pressed in (False, True))
    assert modes == road
    assert "the cords of layer CARCASS" in modes and "buckle, compressed by 0." in modes


def test_slack_cords_make_it_stable() -> None:
    assert failure(passenger(False), pressed=False) == ""


def test_the_message_says_what_to_do() -> None:
    case = passenger(True)
    question = Question({**start_values(case), **FLAT_BELTS})
    with pytest.raises(EvaluationFailed, match=r"not stable") as failed:
        Evaluator(TyreDesign(case)).evaluate(question)
    assert failed.value.cause == "unstable"
    assert "materials.polyester_cord.bears_compression: false" in str(failed.value)


def test_a_tyre_that_turns_is_told_its_highest_stable_speed() -> None:
    """Within 1 % of it: stable just below, unstable just above, by the judgement itself."""
    words, case = {}, with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
    for spin in (174.0, 177.5, 200.0):
        texts = Decks(TyreDesign(case).at(spinning(spin))).texts("abaqus")
        jobs = {name.removesuffix(".inp"): text for name, text in texts.items()}
        try:
            Job(Deck(jobs, "modes", "inflate"), Request(harmonics=[0])).run()
            words[spin] = ""
        except RunFailed as failed:
            words[spin] = str(failed)
    assert words[174.0] == ""
    assert words[177.5].startswith("at 177.5 rad/s the inflated tyre is not stable: its stiffness")
    assert 174.0 < float(words[200.0].split("stable up to ")[1].split()[0]) < 177.5


def spinning(spin: float) -> dict[str, float]:
    return {"spin_rad_per_s": spin, "pressure_kPa": 240.0}
