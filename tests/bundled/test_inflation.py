"""Paths to the inflated state: whole load, stiffer rubber, load by load, from a given shape.

Agreement of modes, sensitivities, inflation and a press on the road about stability.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import Bundled
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.start import FILE, read_start, write_start
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.section import inflation
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.errors import NoEquilibrium, Refused, RunFailed

from tests.studies.wrinkles import by_size, with_compression
from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from . import support

Array = np.ndarray


FULL = 1e5  # Pa


@pytest.fixture(scope="module")
def small() -> Model:
    b = support.block((0.2, 0.21, 1), (0.0, 0.01, 1), False)
    return support.model_of(support.deck(b.X, b.solids, support.Rubber(), (), b.inner))


@dataclass
class Newton:
    """Stand-in for Newton's method. The state is its share and stiffness; it is found if
    ``bears`` accepts the last share and stiffness and these. It remembers its calls, each of two
    factors."""

    bears: Callable[[float, float, float, float], bool]
    asked: list[tuple[float, float, int]] = field(default_factory=list)

    def __call__(
        self, model: Model, numbering: object, loads: list[Pressure], mass: object, U: Array, *rest
    ) -> tuple[Array | None, int, str]:
        tension, longest = rest
        assert tension == (0.0 if U.any() else pytest.approx(0.3 * 0.01 * loads[0].pressure))
        share = loads[0].pressure / FULL
        stiffness = float(np.real(model.parts[0].law.C10[0])) / support.Rubber().C10
        self.asked.append((share, stiffness, longest))
        before = U.ravel()[0], U.ravel()[1] or 1.0
        if not self.bears(*before, share, stiffness):
            return None, 2, "it wrinkles"
        result = np.zeros_like(U)
        result.ravel()[:2] = share, stiffness
        return result, 2, ""


def inflate(
    small: Model, monkeypatch: pytest.MonkeyPatch, newton: Newton
) -> tuple[Array, int, list[int]]:
    looks: list[int] = []
    monkeypatch.setattr(inflation, "_newton", newton)
    U, used = inflation.equilibrium(
        small,
        support.numbering(small),
        support.cavity(small, FULL),
        np.zeros((len(small.mesh.X), 3)),
        lambda: looks.append(len(newton.asked)),
    )
    return U, used, looks


def test_the_whole_load_is_tried_first(small: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    newton = Newton(lambda *state: True)
    U, used, looks = inflate(small, monkeypatch, newton)
    assert newton.asked == [(1.0, 1.0, 18)] and used == 2 and not looks
    assert U.ravel()[0] == 1.0


@pytest.mark.parametrize(
    ("most", "stiffness"),
    [(8.0, [8, 1]), (7.9, [8, 1, 8**0.5, 1]), (2.0, [8, 1, 8**0.5, 8**0.75, 8**0.5, 8**0.25, 1])],
)
def test_stiff_rubber_is_let_down(
    small: Model, monkeypatch: pytest.MonkeyPatch, most: float, stiffness: list[float]
) -> None:
    """Stiffness falls by factors up to ``most``. A factor that is too large is replaced by its
    root; only the first iteration may be long, and the time limit is checked before each further
    one."""
    newton = Newton(lambda _, before, share, now: now == 8 or 1 < before <= most * now)
    U, used, looks = inflate(small, monkeypatch, newton)
    assert [s for _, s, _ in newton.asked] == pytest.approx([1, *stiffness])
    assert [longest for *_, longest in newton.asked] == [18, 30] + [18] * (len(stiffness) - 1)
    assert all(share == 1.0 for share, *_ in newton.asked)
    assert tuple(U.ravel()[:2]) == (1.0, 1.0) and used == 2 * len(newton.asked)
    assert looks == [1, *range(2, len(newton.asked))]


@pytest.mark.parametrize("most", [0.25, 0.24, 1 / 256])
def test_the_load_comes_in_steps(
    small: Model, monkeypatch: pytest.MonkeyPatch, most: float
) -> None:
    """The load rises by a quarter, then by twice the last step, or by half of it if that was too
    much, down to a 256th, if stiff rubber does not yield by a tenth."""
    newton = Newton(
        lambda reached, before, share, now: (
            now == 8 or (now == 1 and before == 1 and share - reached <= most)
        )
    )
    U, used, _ = inflate(small, monkeypatch, newton)
    assert tuple(U.ravel()[:2]) == (1.0, 1.0) and used == 2 * len(newton.asked)
    letting_down = [s for _, s, _ in newton.asked[2:] if s > 1]
    assert letting_down == pytest.approx([8 / 8 ** (0.5**i) for i in range(1, 5)])
    shares = [share for share, s, longest in newton.asked if s == 1 and longest == 30]
    reached, step, wanted = 0.0, 0.25, []
    while reached < 1:
        wanted.append(min(1.0, reached + step))
        if wanted[-1] - reached <= most:
            reached, step = wanted[-1], 2 * step
        else:
            step /= 2
    assert shares == wanted


def test_where_no_load_step_helps_it_says_how_far_it_came(
    small: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    newton = Newton(lambda _, before, share, now: now == 1 and share <= 0.3)
    with pytest.raises(
        NoEquilibrium, match=r"^inflation stopped at 29\.\d+ of 100 kPa: it wrinkles$"
    ):
        inflate(small, monkeypatch, newton)
    last = newton.asked[-1][0]
    assert 0.3 < last <= 0.3 + 1 / 256


def test_how_newtons_method_ends(small: Model) -> None:
    """Newton's method ends at once in equilibrium. After too few iterations, and if no inertia
    holds back what yields, it ends with the reason."""
    number = support.numbering(small, support.held(small, [2, 3]))  # the outside

    def run(U: Array, pressure: float, longest: int, mass: float) -> tuple[Array | None, int, str]:
        masses = lambda: np.full(number.size, mass)
        loads = support.cavity(small, pressure)
        return inflation._newton(small, number, loads, masses, U, 0.0, longest)

    at = np.zeros((len(small.mesh.X), 3))
    assert run(at, 0.0, 5, 1.0)[1:] == (0, "")
    assert run(at, 1e4, 1, 1.0) == (None, 1, "Newton's method did not converge in 1 iterations")
    state, used, _ = run(at, 1e4, 30, 1.0)
    assert state is not None and used <= 6
    assert run(state, 1e4, 30, 1.0)[1:] == (0, "")
    # none, then 4e5 to 4e15 by tens
    assert run(at, 1e9, 30, 0.0) == (None, 12, "the tangent stiffness is not positive definite")


CASE = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")


START = start_values(CASE)


STIFFER = {name: 1.2 * value for name, value in START.items()}


def answer(folder: Path, values: dict[str, float], start: np.ndarray | None = None) -> dict:
    """Results of the solver for a design from a start, its factorisations among them."""
    folder.mkdir()
    solver = Bundled()
    solver.write(Decks(TyreDesign(CASE, values), ("C10",), start=start), folder)
    solver.run(folder, 60.0)
    return solver.read(folder)


def shape(result: dict) -> np.ndarray:
    return np.column_stack([result["nodes"], result["displacement"]])


@pytest.fixture(scope="module")
def nominal(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    return shape(answer(tmp_path_factory.mktemp("start") / "run", START))


def factorisations(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Counts of factorisations, one for each inflation from now on."""
    from tyrecal_solvers.bundled import job

    counted: list[int] = []
    whole = job.equilibrium

    def counting(*arguments):
        result = whole(*arguments)
        counted.append(result[1])
        return result

    monkeypatch.setattr(job, "equilibrium", counting)
    return counted


def assert_same(one: dict, other: dict) -> None:
    size = abs(other["displacement"]).max()
    assert one["displacement"] == pytest.approx(other["displacement"], abs=1e-9 * size)
    for a, b in zip(one["modes"], other["modes"], strict=True):
        assert a["frequency_Hz"] == pytest.approx(b["frequency_Hz"], rel=1e-9)
    assert one["gradients"]["C10"] == pytest.approx(other["gradients"]["C10"], rel=1e-6)


def test_the_same_state_in_fewer_steps(
    tmp_path: Path, nominal: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = factorisations(monkeypatch)
    rest = answer(tmp_path / "rest", STIFFER)
    first = max(counted)
    counted.clear()
    near = answer(tmp_path / "near", STIFFER, nominal)
    assert 0 < max(counted) < first
    assert_same(near, rest)


def test_nodes_may_come_in_any_order(tmp_path: Path, nominal: np.ndarray) -> None:
    one = answer(tmp_path / "one", STIFFER, nominal)
    other = answer(tmp_path / "other", STIFFER, nominal[::-1])
    assert (one["displacement"] == other["displacement"]).all()


@pytest.mark.parametrize("kind", ["fewer nodes", "other numbers", "far off", "inside out"])
def test_a_shape_that_does_not_help_does_no_harm(
    kind: str, tmp_path: Path, nominal: np.ndarray
) -> None:
    """A start of another mesh is ignored, and a start that leads nowhere is replaced by the tyre at
    rest."""
    start = nominal.copy()
    if kind == "fewer nodes":
        start = start[:-1]
    elif kind == "other numbers":
        start[0, 0] += 0.5
    elif kind == "far off":
        start[:, 1:] *= 40
    else:
        start[:, 1] = -3.0
    assert_same(answer(tmp_path / "start", STIFFER, start), answer(tmp_path / "rest", STIFFER))


def test_the_deck_names_its_shape(tmp_path: Path, nominal: np.ndarray) -> None:
    line = write_start(tmp_path, nominal)
    read = read_start(tmp_path, f"*HEADING\n{line}")
    assert read is not None and (read == nominal).all()
    assert read_start(tmp_path, "*HEADING\n** no start\n") is None
    (tmp_path / FILE).rename(tmp_path / "elsewhere.npy")
    with pytest.raises(Refused, match="not next to it"):
        read_start(tmp_path, line)
    write_start(tmp_path, 2 * nominal)
    with pytest.raises(Refused, match="SHA-256 differs"):
        read_start(tmp_path, line)
    with pytest.raises(Refused, match="four numbers a node"):
        read_start(tmp_path, write_start(tmp_path, nominal[:, :3]))
    with pytest.raises(Refused, match="not next to it"):
        read_start(tmp_path, line.replace(FILE, "/etc/passwd"))


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
