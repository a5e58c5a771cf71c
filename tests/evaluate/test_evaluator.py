"""The evaluator with a stand-in's answers: what is kept, counted, told, limited and believed."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tyrecal.simulate import provenance
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate import cluster
from tyrecal.simulate.evaluate import evaluator as door_module
from tyrecal.simulate.evaluate.cluster import _at_worker
from tyrecal.simulate.evaluate.evaluator import Counts, Evaluator, Question
from tyrecal.simulate.evaluate.executor import Here
from tyrecal.simulate.evaluate.failure import EvaluationFailed, SolverUnavailable
from tyrecal.simulate.evaluate.folders import drop_unfinished
from tyrecal.simulate.evaluate.pressed import pressed
from tyrecal.simulate.evaluate.record import Damaged
from tyrecal.simulate.evaluate.recorded import check, contradiction
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.provenance import sources

from ..studies.hertz import Hertz
from .stand_in import CASE, StandIn, ask, evaluator

Edit = Callable[[dict[str, Any]], Any]


def test_a_run_that_went_well_is_kept_where_that_is_asked(tmp_path: Path) -> None:
    """The folder has a word on the outcome, as folders of failures always have."""
    subject = evaluator(tmp_path)
    ask(subject)
    assert not list((tmp_path / "runs").iterdir())
    subject.keep = True
    ask(subject, 2e6)
    (kept,) = (tmp_path / "runs").iterdir()
    assert (kept / "outcome.txt").read_text() == "finished\n" and (kept / "deck.inp").exists()
    failing = evaluator(tmp_path, StandIn("unstable"))
    with pytest.raises(EvaluationFailed):
        ask(failing, 3e6)
    (other,) = set((tmp_path / "runs").iterdir()) - {kept}
    assert (other / "outcome.txt").read_text() == "said: unstable\n"
    (tmp_path / "runs" / "run-cut-off").mkdir()
    drop_unfinished(tmp_path / "runs")
    assert set((tmp_path / "runs").iterdir()) == {kept, other}


def test_a_failure_without_a_folder_of_runs_leaves_none() -> None:
    with pytest.raises(EvaluationFailed) as failure:
        Evaluator(TyreDesign(CASE), _solver=StandIn("crashed")).evaluate(Question({"C10": 1e6}))
    assert failure.value.folder is None


@pytest.mark.parametrize("place", ["here", "gone", "elsewhere", "below", "none", "a NUL"])
def test_a_record_names_a_folder_of_ours_or_none(tmp_path: Path, place: str) -> None:
    """The folder of a failed run is next to the others and contains an outcome."""
    runs = tmp_path / "runs"
    at = {"elsewhere": tmp_path / "run-1", "below": runs / "a" / "run-1"}.get(place, runs / "run-1")
    at.mkdir(parents=True)
    if place != "gone":
        (at / "outcome.txt").write_text("failed")
    named = {"none": None, "a NUL": "a\0b"}.get(place, str(at))
    assert evaluator(tmp_path)._known(named) == (at if place == "here" else None)
    assert Evaluator(TyreDesign(CASE))._known(str(at)) is None


def test_time_limits_grow_with_loads_and_modes(tmp_path: Path) -> None:
    solver = Hertz()
    solver.capabilities = solver.capabilities | {"loaded_modes"}  # type: ignore[misc]
    limits: list[float] = []
    solver.run = lambda folder, limit: limits.append(limit)  # type: ignore[method-assign]
    subject = Evaluator(TyreDesign(CASE), folder=tmp_path, _solver=solver)
    one = CASE.case.solver.time_limit_s
    subject.press({}, [500.0, 900.0])
    with pytest.raises(EvaluationFailed, match="not 2 modes"):
        subject.press({}, [500.0, 900.0], modes=2)
    assert limits == [2 * one, 6 * one]
    alone = StandIn()
    alone.run = lambda folder, limit: limits.append(limit)  # type: ignore[method-assign]
    ask(evaluator(tmp_path, alone))
    assert limits[2:] == [one]


def test_a_record_of_another_pressure_is_not_this_ones(tmp_path: Path) -> None:
    """Pressures are compared to a millionth."""
    for off, runs in ((0.9e-6, 0), (1.1e-6, 1)):
        ask(evaluator(tmp_path))
        again = evaluator(tmp_path)
        read = again.store.read  # type: ignore[union-attr]

        def changed(key: str, off: float = off, read: Any = read) -> Any:
            content = read(key)
            content["answer"]["pressure_Pa"] *= 1 + off
            return content

        again.store.read = changed  # type: ignore[union-attr, method-assign]
        ask(again)
        assert again.counts == Counts(runs, 1 - runs)


@pytest.mark.parametrize("jobs", [1, 2])
def test_of_several_questions_each_is_heard_counted_and_may_fail(
    tmp_path: Path, jobs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here, or by workers, one of which dies; a single question needs none."""
    given: list[tuple[Any, ...]] = []

    class Workers(Here):
        def each(self, function: Any, tasks: Any) -> Any:
            for place, task in enumerate(tasks):
                given.append(task)
                yield (
                    place,
                    EvaluationFailed("crashed", "it died") if place == 2 else function(task),
                )

    monkeypatch.setattr(door_module, "executor", lambda *arguments: nullcontext(Workers()))
    progress: list[tuple[int, int]] = []
    subject = replace(evaluator(tmp_path), on_progress=lambda *done: progress.append(done))

    def worker() -> Evaluator:
        other = Evaluator.worker(subject)
        other._solver = subject.solver
        return other

    subject.worker = worker  # type: ignore[method-assign]
    questions = [Question({"C10": value}) for value in (1e6, 2e6, 3e6)]
    answers = list(subject.answer_all(questions, jobs))
    assert progress == [(0, 3), (1, 3), (2, 3), (3, 3)]
    lost = [isinstance(answer, EvaluationFailed) for answer in answers]
    assert lost == [False, False, jobs == 2] and len(given) == (3 if jobs == 2 else 0)
    if jobs == 2:
        assert answers[2].cause == "crashed"  # type: ignore[union-attr]
    assert subject.counts.runs >= (2 if jobs == 2 else 3)
    list(subject.answer_all(questions[:1], jobs))
    assert subject.counts.recorded == 1 and len(given) == (3 if jobs == 2 else 0)


def test_a_worker_has_counts_of_its_own_another_case_has_not(tmp_path: Path) -> None:
    subject = evaluator(tmp_path)
    subject.keep, subject.command, subject.scheduler = True, ("a",), "tcp://there"
    other = subject.worker()
    assert other.counts is not subject.counts and other.folder == subject.folder and other.keep
    assert other.store is subject.store and other.command == ("a",) and not other.scheduler
    same = subject.of(TyreDesign(CASE))
    assert same.counts is subject.counts and same.on_progress is subject.on_progress


def footprint(load: float, **changes: Any) -> dict[str, Any]:
    """Answer of a solver about one load, with a patch of two nodes."""
    two = np.ones(2)
    plain: dict[str, Any] = {
        "load_N": load,
        "road_N": load,
        "rim_N": np.array([load, 0.0, 0.0]),
        "deflection_m": 0.01,
        "stiffness_N_per_m": 2e5,
        "ring": np.array([0, 1]),
        "node": np.array([0, 2]),
        "along_m": two,
        "across_m": two,
        "pressure_Pa": two,
        "area_m2": two,
        "traction_Pa": np.ones((2, 2)),
        "displacement": np.zeros((4, 3, 3)),
    }
    return {**plain, **changes}


def modes_told(count: int, lowest: float = 30.0) -> dict[str, Any]:
    return {
        "mode_frequency_Hz": lowest + np.arange(count),
        "mode_node": np.array([0, 1]),
        "mode_shape": np.zeros((count, 4, 2, 3)),
    }


def road(*footprints: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """A solver's answer of a tyre of 4 rings of 3 nodes."""
    plain = {
        "pressure_Pa": 240e3,
        "mass_kg": 12.0,
        "nodes": np.arange(3),
        "points": np.arange(6.0).reshape(3, 2),
        "angles": np.arange(4.0),
        "free_radius_m": 0.3,
        "footprints": list(footprints),
        "failure": "",
    }
    return {**plain, **changes}


def test_loads_are_those_that_were_asked_for() -> None:
    """Loads agree to 1e-9 of themselves, and are borne to 1 %."""
    for off, whole in ((0.9e-9, True), (1e-7, False)):
        if whole:
            assert pressed(road(footprint(500 * (1 + off))), [500.0], None).failed is None
        else:
            with pytest.raises(EvaluationFailed, match="footprints at"):
                pressed(road(footprint(500 * (1 + off))), [500.0], None)
    for bears, whole in ((495.5, True), (504.5, True), (494.5, False), (505.5, False)):
        answer = road(footprint(500.0, road_N=bears))
        if whole:
            assert pressed(answer, [500.0], None).footprints[0].road_N == bears
        else:
            with pytest.raises(EvaluationFailed, match="the road bears"):
                pressed(answer, [500.0], None)


def test_modes_on_the_road_are_as_many_as_were_asked_for() -> None:
    footprints = lambda changes, modes: pressed(
        road(footprint(500.0, **changes)), [500.0], None, modes
    )
    assert footprints(modes_told(3), 3).footprints[0].mode_frequency_Hz is not None
    assert footprints(modes_told(4), 3) and footprints({}, 0)
    for wrong in (modes_told(2), modes_told(3, 0.0), modes_told(3, -1.0), {}):
        with pytest.raises(EvaluationFailed, match="not 3 modes at 500 N"):
            footprints(wrong, 3)


PLAIN: dict[str, tuple[Edit, str]] = {
    "as it is": (lambda a: None, ""),
    "no pressure": (lambda a: a.update(pressure_Pa=0.0), ""),
    "suction": (lambda a: a.update(pressure_Pa=-1.0), "above"),
    "no mass": (lambda a: a.update(mass_kg=0.0), "above"),
    "no waves": (lambda a: a["modes"][0].update(n=0), ""),
    "fewer waves than none": (lambda a: a["modes"][0].update(n=-1), "above"),
    "half a wave": (lambda a: a["modes"][0].update(n=0.5), "not such a number"),
    "not even one": (lambda a: a["modes"][0].update(multiplicity=0), "above"),
    "two members": (lambda a: a["modes"][0].update(members=[1.0, 2.0]), ""),
    "a member of 0 Hz": (lambda a: a["modes"][0].update(members=[0.0, 2.0]), "above"),
    "a flat shape": (lambda a: a["modes"][0].update(amplitude=np.ones((3, 2))), "has the shape"),
    "few points of a shape": (
        lambda a: a["modes"][0].update(amplitude=np.ones((2, 3))),
        "not as many points",
    ),
    "a shape of infinity": (
        lambda a: a["modes"][0].update(amplitude=np.full((3, 3), np.inf)),
        "not finite",
    ),
    "in three dimensions": (lambda a: solid(a), ""),
    "in three, of other nodes": (lambda a: solid(a, nodes=np.arange(7)), ""),
    "in three, not measured all over": (
        lambda a: solid(a, displacement=np.diag([np.nan, 1.0, np.nan])),
        "",
    ),
    "a shape of zeros": (lambda a: solid(a, displacement=np.zeros((3, 3))), "0 at all points"),
    "in four": (lambda a: solid(a, points=np.arange(12.0).reshape(3, 4)), "do not go together"),
    "on a line": (lambda a: solid(a, points=np.arange(3.0)[:, None]), "do not go together"),
    "a section of other nodes": (lambda a: a.update(nodes=np.arange(7)), "do not go together"),
    "nodes in fractions": (lambda a: a.update(nodes=np.arange(3.0)), "not such a number"),
    "no inflation": (lambda a: a.update(displacement=np.zeros((0, 3))), ""),
    "half an inflation": (lambda a: a.update(displacement=np.zeros((2, 3))), "inflation"),
    "two slopes of a mode": (lambda a: a.update(gradients={"a": [1.0, 2.0]}), "not every mode"),
}


def solid(answer: dict[str, Any], displacement: Any = None, **more: Any) -> None:
    shape = np.ones((3, 3)) if displacement is None else displacement
    entry = {"frequency_Hz": 50.0, "multiplicity": 1, "displacement": shape}
    answer.update(
        {"modes": [entry], "points": np.arange(9.0).reshape(3, 3), "gradients": {}, **more}
    )


@pytest.mark.parametrize("kind", PLAIN)
def test_what_a_record_of_modes_may_hold(kind: str, tmp_path: Path) -> None:
    edit, words = PLAIN[kind]
    answer = StandIn().read(tmp_path)
    edit(answer)
    if words:
        with pytest.raises(Damaged, match=words):
            check({"answer": answer})
    else:
        check({"answer": answer})


LIES: dict[str, tuple[Edit, str]] = {
    "a state of zeros": (lambda a: a.update(displacement=np.zeros((3, 3))), "without pressure"),
    "a section of zeros": (lambda a: a.update(points=np.zeros((3, 2))), "do not span a section"),
    "a shape of zeros": (
        lambda a: a["modes"][0].update(amplitude=np.zeros((3, 3))),
        "modes.0: a mode's shape is 0 at all points",
    ),
    "beyond all tyres": (lambda a: a["modes"][0].update(frequency_Hz=1e6), "at most 100000"),
    "next to nothing": (lambda a: a["modes"][0].update(frequency_Hz=1e-4), "above 0.001"),
    "no modes": (lambda a: a.update(modes=[], gradients={}), "at least 1"),
    "another pressure": (
        lambda a: a.update(pressure_Pa=2.3e5),
        "of 230 kPa, 240 kPa were requested",
    ),
    "another harmonic": (
        lambda a: a["modes"][0].update(n=5),
        "a mode of harmonic 5, the highest requested is 4",
    ),
    "too many of one": (
        lambda a: a.update(modes=3 * a["modes"], gradients={}),
        "3 modes of harmonic 2, 2 were requested",
    ),
    "too many": (
        lambda a: solid(a, modes=21 * [{"frequency_Hz": 9.0, "multiplicity": 1, **MOVED}]),
        "21 modes, 20 at most were requested",
    ),
    "no answer": (lambda a: a.clear(), "pressure_Pa: Field required"),
}
MOVED = {"displacement": np.ones((3, 3))}


@pytest.mark.parametrize("kind", LIES)
def test_a_solvers_lie_is_a_failure_with_its_reason(kind: str, tmp_path: Path) -> None:
    """A wrong answer is stored nowhere."""
    edit, words = LIES[kind]

    class Liar(StandIn):
        def read(self, folder: Path) -> dict[str, Any]:
            answer = super().read(folder)
            edit(answer)
            return answer

    with pytest.raises(EvaluationFailed, match=words) as failure:
        ask(evaluator(tmp_path, Liar()))
    assert failure.value.cause == "no_results"
    assert "the result of solver 'stand-in' is not used" in failure.value.words
    assert not list((tmp_path / "record").glob("*/*.record"))


@pytest.mark.parametrize(
    ("deck", "words"),
    [
        ("*NODE, NSET=TYRE\n7, 0.3, -0.1\n8, 0.3, 0.1\n*ELEMENT\n7, 8\n*NODE\n9, 0, 0\n", ""),
        ("*node\n7, 0.3, 0.0, -0.1\n8, 0.3, 0.0, 0.1\n", ""),  # of a sector, at the angle 0
        ("*NODE\n7, 0.30002, -0.1\n8, 0.3, 0.1\n", ""),  # six digits
        ("*NODE\n7, 0.3, -0.1\n9, 0.3, 0.1\n*NODE FILE\nU\n", "node 8 is not in the deck"),
        ("*NODE\n7, 0.3, -0.1\n8, 0.31, 0.1\n", "node 8 is not where the deck has it"),
        ("*NODE\n7, 0.3, -0.1\n*NGEN\n7, 8, 1\n", ""),
        ("*NODE PRINT\nU\n", ""),
    ],
)
def test_the_nodes_of_an_answer_are_those_of_the_deck(
    deck: str, words: str, tmp_path: Path
) -> None:
    (tmp_path / "section.inp").write_text(deck)
    answer = {"nodes": np.array([7, 8]), "points": np.array([[0.3, -0.1], [0.3, 0.1]])}
    decks = SimpleNamespace(design=SimpleNamespace(pressure_kPa=240.0), request={})
    assert contradiction({**answer, "pressure_Pa": 2.4e5}, decks, tmp_path) == words  # type: ignore


PRESSED: dict[str, tuple[dict[str, Any], str]] = {
    "whole": (road(footprint(500.0)), ""),
    "with modes": (road(footprint(500.0, **modes_told(2))), ""),
    "with an area": (road(footprint(500.0, contact_area_m2=0.01)), ""),
    "of no area": (road(footprint(500.0, contact_area_m2=0.0)), "above"),
    "of no load": (road(footprint(0.0)), "above"),
    "none": (road(), "at least 1"),
    "ended early": (road(footprint(500.0), failure="no", cause="unstable"), ""),
    "ended otherwise": (road(footprint(500.0), failure="no", cause="timed_out"), "no_equilibrium"),
    "a free radius of 0": (road(footprint(500.0), free_radius_m=0.0), "above"),
    "a ring too many": (road(footprint(500.0, ring=np.array([0, 4]))), "not on this tyre"),
    "a node that is not there": (road(footprint(500.0, node=np.array([0, 3]))), "not on this tyre"),
    "moved rings too few": (road(footprint(500.0, displacement=np.zeros((3, 3, 3)))), "not on"),
    "moved nodes too few": (road(footprint(500.0, displacement=np.zeros((4, 2, 3)))), "not on"),
    "a place too many": (road(footprint(500.0, along_m=np.ones(3))), "lists do not go together"),
    "tractions too few": (road(footprint(500.0, traction_Pa=np.ones((1, 2)))), "lists do not go"),
    "an unknown field": (road(footprint(500.0, more=1.0)), "Unexpected keyword"),
    "modes without nodes": (
        road(footprint(500.0, **{**modes_told(2), "mode_node": None})),
        "a part is missing",
    ),
    "modes without frequencies": (
        road(footprint(500.0, **{**modes_told(2), "mode_frequency_Hz": None})),
        "a part is",
    ),
    "a shape too few": (
        road(footprint(500.0, **{**modes_told(2), "mode_shape": np.zeros((1, 4, 2, 3))})),
        "modes under load do not go",
    ),
    "a ring of shapes too few": (
        road(footprint(500.0, **{**modes_told(2), "mode_shape": np.zeros((2, 3, 2, 3))})),
        "modes under load do not go",
    ),
    "a node of shapes too many": (
        road(footprint(500.0, **{**modes_told(2), "mode_shape": np.zeros((2, 4, 3, 3))})),
        "modes under load do not go",
    ),
}


@pytest.mark.parametrize("kind", PRESSED)
def test_what_a_record_of_a_road_may_hold(kind: str) -> None:
    answer, words = PRESSED[kind]
    if words:
        with pytest.raises(Damaged, match=words):
            check({"answer": answer})
    else:
        check({"answer": answer})


def test_leftovers_of_killed_writers_go_after_an_hour(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.write("ab" * 32, {"solver": "s", "version": "1"}, {"x": 1})
    for name, age in (("young", 3500.0), ("old", 3700.0)):
        path = tmp_path / "ab" / f"{name}.partial"
        path.write_text("half")
        os.utime(path, times=(time.time() - age,) * 2)
    assert store.prune() == 0
    assert sorted(p.suffix for p in tmp_path.glob("*/*")) == [".partial", ".record"]
    assert (tmp_path / "ab" / "young.partial").exists()


@pytest.mark.parametrize(("workers", "cores", "jobs"), [(8, 4, 2), (9, 4, 3), (1, 1, 1)])
def test_as_many_jobs_as_the_workers_need(
    workers: int, cores: int, jobs: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The jobs end, whatever happens."""
    path = tmp_path / "here.yaml"
    path.write_text(f"queueing_system: local\nworkers: {workers}\ncores: {cores}\n")
    done: list[Any] = []
    jobs_of = SimpleNamespace(
        adapt=lambda **bounds: done.append(bounds),
        scheduler_address="tcp://there",
        close=lambda: done.append("closed"),
    )
    monkeypatch.setattr(cluster, "jobs_of", lambda settings: jobs_of)
    with pytest.raises(ZeroDivisionError), cluster.reached(str(path)) as address:
        assert address == "tcp://there"
        1 / 0  # noqa: B018
    assert done == [{"minimum_jobs": jobs, "maximum_jobs": jobs}, "closed"]
    with cluster.reached("tcp://elsewhere") as address:
        assert address == "tcp://elsewhere"


def test_workers_of_another_edition_are_refused() -> None:
    assert _at_worker(abs, sources(), -3) == 3
    with pytest.raises(SolverUnavailable, match="another edition"):
        _at_worker(abs, "0" * 64, -3)


def test_the_sources_hash_tells_names_and_contents(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever the order in which a disk lists them; other files count for nothing."""
    monkeypatch.setattr(provenance, "files", lambda package: tmp_path / package)
    for package in provenance.PACKAGES:
        (tmp_path / package / "in").mkdir(parents=True)
    path = tmp_path / "tyrecal" / "in" / "a.py"
    hashes = []
    for name, text in (("a.py", "1"), ("b.py", "1"), ("b.py", "2"), ("b.txt", "2")):
        path = path.rename(path.with_name(name)) if path.exists() else path
        path.write_text(text)
        hashes.append(sources.__wrapped__())
    template = tmp_path / "tyrecal_templates" / "a.j2"
    template.write_text("x")
    hashes.append(sources.__wrapped__())
    template.rename(tmp_path / "tyrecal_templates" / "in" / "a.j2")
    hashes.append(sources.__wrapped__())
    (tmp_path / "tyrecal" / "in" / "b.pyc").write_text("x")
    assert len(set(hashes)) == len(hashes) == 6 and sources.__wrapped__() == hashes[-1]
