"""The record: the same answer to the last bit, never a damaged one, safe for many writers."""

from __future__ import annotations

import importlib
import logging
import os
import time
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate import store as store_module
from tyrecal.simulate.evaluate.evaluator import Counts, Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.pool import warm_up
from tyrecal.simulate.evaluate.record import Damaged, pack, unpack
from tyrecal.simulate.evaluate.results import Evaluation, HarmonicShape
from tyrecal.simulate.evaluate.store import Store

from .stand_in import CASE, StandIn, ask, evaluator

ABOUT = {"solver": "s", "version": "1"}


def same(one: Evaluation, other: Evaluation) -> None:
    """Equal to the last bit, in type and layout too."""
    assert (one.pressure_kPa, one.mass_kg) == (other.pressure_kPa, other.mass_kg)
    assert one.gradients.keys() == other.gradients.keys()
    pairs = [(one.gradients[k], other.gradients[k]) for k in one.gradients]
    pairs += [(one.nodes, other.nodes), (one.displacement, other.displacement)]
    for a, b in zip(one.modes, other.modes, strict=True):
        assert (a.frequency_Hz, a.multiplicity) == (b.frequency_Hz, b.multiplicity)
        assert isinstance(a.shape, HarmonicShape) and isinstance(b.shape, HarmonicShape)
        assert a.shape.n == b.shape.n and {a.shape.n: 1}[b.shape.n]
        pairs += [(a.shape.amplitude, b.shape.amplitude), (a.shape.points, b.shape.points)]
    for x, y in pairs:
        assert x.dtype == y.dtype and x.strides == y.strides and x.tobytes() == y.tobytes()


def records(folder: Path) -> list[Path]:
    return sorted((folder / "record").glob("*/*.record"))


def test_plain_data_survives_exactly() -> None:
    content = {
        "numbers": [0.1 + 0.2, 5e-324, -0.0, 10**30, True, None, "ü\n"],
        "arrays": [np.arange(6.0).reshape(2, 3).T, np.array(["a", "bc"]), np.zeros(1)],
        "scalars": [np.float32(0.1), np.int64(7), 2 + 3j],
    }
    about, back = unpack(pack("k", {"solver": "s"}, content), "k")
    assert about == {"solver": "s"}
    assert back["numbers"] == content["numbers"] and str(back["numbers"][2]) == "-0.0"
    assert back["scalars"] == content["scalars"] and hash(back["scalars"][1]) == hash(7)
    for a, b in zip(content["arrays"], back["arrays"], strict=True):
        assert isinstance(a, np.ndarray)
        assert a.dtype == b.dtype and a.strides == b.strides and (a == b).all()


@pytest.mark.parametrize("content", [{1: 2}, {"x": object()}, [np.array([object()])]])
def test_what_json_and_npz_cannot_hold_is_refused(content: object) -> None:
    with pytest.raises(TypeError):
        pack("k", {}, content)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_a_number_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(ValueError):
        pack("k", {}, {"x": [1.0, value]})
    with pytest.raises(ValueError):
        pack("k", {"seconds": value}, {})


def test_any_changed_or_missing_byte_is_seen() -> None:
    data = pack("k", {}, {"x": np.arange(50.0), "y": [1.5, "word"]})
    for place in range(0, len(data), 7):
        changed = bytearray(data)
        changed[place] ^= 1
        with pytest.raises(Damaged):
            unpack(bytes(changed), "k")
        with pytest.raises(Damaged):
            unpack(data[:place], "k")
    with pytest.raises(Damaged):
        unpack(data + data, "k")


def test_the_record_answers_like_the_solver(tmp_path: Path) -> None:
    first = evaluator(tmp_path)
    fresh = ask(first)
    again = evaluator(tmp_path)
    same(fresh, ask(again))
    assert (first.counts, again.counts) == (Counts(1, 0), Counts(0, 1))
    assert ask(again, 2e6) and again.counts == Counts(1, 1)
    assert not any((tmp_path / "runs").iterdir())


def test_the_bundled_solvers_answers_too(tmp_path: Path) -> None:
    question = Question({"A_belt": 2.1e-7, "C10": 9e5}, ("A_belt", "C10"))
    plain = Evaluator(TyreDesign(CASE)).evaluate(question)
    for runs in (2, 0):  # the nominal tyre's first, for its shape
        recorded = Evaluator(TyreDesign(CASE), store=Store(tmp_path))
        same(plain, recorded.evaluate(question))
        assert recorded.counts.runs == runs


@pytest.mark.parametrize("damage", ["cut", "empty", "flipped", "doubled", "stranger"])
def test_a_damaged_record_is_computed_again(
    damage: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    fresh = ask(evaluator(tmp_path))
    (path,) = records(tmp_path)
    data = path.read_bytes()
    middle = len(data) // 2
    path.write_bytes(
        {
            "cut": data[:middle],
            "empty": b"",
            "flipped": data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :],
            "doubled": data + data,
            "stranger": b"not a record\n",
        }[damage]
    )
    for runs in (1, 0):
        again = evaluator(tmp_path)
        same(fresh, ask(again))
        assert again.counts.runs == runs
    assert [str(path) in r.getMessage() for r in caplog.records] == [True]  # said once
    assert path.read_bytes() == data
    assert Store(tmp_path / "record").summary()["damaged"] == 1


@pytest.mark.parametrize(
    ("cause", "recorded"),
    [
        ("no_equilibrium", True),
        ("unstable", True),
        ("timed_out", False),
        ("crashed", False),
        ("licence", False),
        ("no_results", False),
    ],
)
def test_only_failures_of_the_deck_are_recorded(cause: str, recorded: bool, tmp_path: Path) -> None:
    folders = []
    solver = StandIn(cause)
    for _ in range(2):
        with pytest.raises(EvaluationFailed, match=f"said: {cause}") as failure:
            ask(evaluator(tmp_path, solver))
        assert failure.value.cause == cause and failure.value.words == f"said: {cause}"
        assert failure.value.folder and (failure.value.folder / "deck.inp").exists()
        folders.append(failure.value.folder)
    assert solver.runs == (1 if recorded else 2)
    assert (folders[0] == folders[1]) == recorded
    assert len(list((tmp_path / "runs").iterdir())) == (1 if recorded else 2)
    assert bool(records(tmp_path)) == recorded


def test_a_recorded_failure_names_its_run_after_a_move(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    with pytest.raises(EvaluationFailed) as failure:
        ask(evaluator(tmp_path / "old", StandIn("unstable")))
    first = failure.value.folder
    moved = (tmp_path / "old").rename(tmp_path / "new")
    with pytest.raises(EvaluationFailed) as failure:
        ask(evaluator(moved, StandIn("unstable")))
    assert first and failure.value.folder == moved / "runs" / first.name
    assert len(list((moved / "runs").iterdir())) == 1


def test_numbers_that_are_none_are_not_recorded(tmp_path: Path) -> None:
    class Zeros(StandIn):
        def read(self, folder: Path) -> dict:
            answer = super().read(folder)
            answer["modes"][0]["frequency_Hz"] = float("nan")
            return answer

    with pytest.raises(EvaluationFailed, match="not finite") as failure:
        ask(evaluator(tmp_path, Zeros()))
    assert failure.value.folder and failure.value.folder.exists()
    assert not records(tmp_path)


def test_another_version_or_reader_is_another_question(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    solver = StandIn()
    ask(evaluator(tmp_path, solver))
    solver.version = "2"
    ask(evaluator(tmp_path, solver))
    monkeypatch.setitem(store_module._SOURCES, StandIn, "an edited reader")
    ask(evaluator(tmp_path, solver))
    ask(evaluator(tmp_path, solver))
    assert solver.runs == 3
    summary = Store(tmp_path / "record").summary(verify=True)
    assert summary["solvers"] == {"stand-in 1": 1, "stand-in 2": 2} and summary["records"] == 3


def test_an_adapter_is_known_by_the_text_of_its_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A change of any module of the package counts, not of the adapter's alone."""
    (tmp_path / "reader.py").write_text("FACTOR = 1\n")
    (tmp_path / "an_adapter.py").write_text("class Adapter:\n    pass\n")
    monkeypatch.syspath_prepend(tmp_path)
    adapter = importlib.import_module("an_adapter").Adapter
    known = [store_module.sources_of(adapter)]
    for name in ("reader", "an_adapter"):
        path = tmp_path / f"{name}.py"
        path.write_text(path.read_text() + "# edited\n")
        monkeypatch.delitem(store_module._SOURCES, adapter)
        known.append(store_module.sources_of(adapter))
    assert len(set(known)) == 3
    monkeypatch.delitem(store_module._SOURCES, adapter)


def _write(folder: Path, number: int) -> None:
    store = Store(folder)
    content = {"answer": {**StandIn().read(folder), "more": np.full(20000, 1 / 3)}}
    for _ in range(20):
        store.write("ab" * 32, ABOUT, content)
        back = store.read("ab" * 32)
        assert back["answer"]["more"].tobytes() == content["answer"]["more"].tobytes()


def test_many_writers_of_one_record(tmp_path: Path) -> None:
    warm_up()  # tests that come later in this process find the fork server that they expect
    workers = [
        get_context("forkserver").Process(target=_write, args=(tmp_path, i)) for i in (1, 2, 3)
    ]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(60)
        assert worker.exitcode == 0
    assert [p.name for p in tmp_path.glob("*/*")] == ["ab" * 32 + ".record"]
    assert Store(tmp_path).summary(verify=True)["records"] == 1


def test_the_least_recently_used_go_first_and_none_of_this_run(tmp_path: Path) -> None:
    old = Store(tmp_path)
    content = {"answer": StandIn().read(tmp_path)}
    keys = [f"{i:02d}" * 32 for i in range(6)]
    for age, key in enumerate(keys):
        old.write(key, ABOUT, content)
        os.utime(old.path(key), times=(time.time() - 9000 - age,) * 2)
    size = old.path(keys[0]).stat().st_size
    store = Store(tmp_path)
    store.read(keys[5])  # the oldest, used again
    store.write("66" * 32, ABOUT, content)
    (tmp_path / "66" / "x.damaged").write_bytes(b"x" * 100)
    assert store.prune(4 * size) == 3
    left = {p.name[:2] for p in tmp_path.glob("*/*")}
    assert left == {"00", "01", "05", "66"}
    assert store.prune(0) == 2 and store.read(keys[5]) and store.read("66" * 32)


def test_a_full_disc_does_not_spoil_an_evaluation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    plain = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        plain(path, data[: len(data) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    subject = evaluator(tmp_path)
    assert ask(subject).modes and ask(subject, 2e6).modes
    assert [r.levelno for r in caplog.records] == [logging.WARNING]  # said once
    assert "No space left" in caplog.text and "not stored" in caplog.text
    assert not list((tmp_path / "record").glob("*/*"))


def test_a_full_disc_under_the_run_is_an_error(tmp_path: Path) -> None:
    class Full(StandIn):
        def run(self, folder: Path, time_limit_s: float) -> None:
            raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match=r"cannot write to '.*run-.*': No space left on"):
        ask(evaluator(tmp_path, Full()))
    assert not any((tmp_path / "runs").iterdir()) and not records(tmp_path)


def test_a_key_tells_what_belongs_to_which_file(tmp_path: Path) -> None:
    """Files of the same names and bytes, one after the other, but parted elsewhere."""
    keys = set()
    for files in ({"a": b"b1", "c": b"2"}, {"ab": b"1", "c": b"2"}, {"a": b"b1c", "2": b""}):
        folder = tmp_path / str(len(keys))
        folder.mkdir()
        for name, content in files.items():
            (folder / name).write_bytes(content)
        keys.add(store_module.key_of(folder, StandIn()))
    assert len(keys) == 3
