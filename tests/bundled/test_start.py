"""Newton's method from a shape beside the deck: the same state, sooner, and no other shape."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import Bundled
from tyrecal_solvers.bundled.deck.start import FILE, read_start, write_start
from tyrecal_solvers.errors import Refused

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.case import start_values, with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES

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
