"""Making, sealing and answering: nothing leaks, nothing can be changed afterwards, all resumes."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.errors import InputError
from tyrecal.measured.tables import read_measurements
from tyrecal.report.blind import page
from tyrecal.simulate.evaluate.store import Store
from tyrecal.studies.blind.answer import answer
from tyrecal.studies.blind.make import Trial, draw, make, readings
from tyrecal.studies.blind.maker import bundled_maker
from tyrecal.studies.blind.protocol import ANSWERS, SEAL, TRUTH, Protocol, read_json, write_json
from tyrecal.studies.blind.ruler import RULER_FILE as RULER
from tyrecal.studies.blind.ruler import measure
from tyrecal.studies.blind.score import score, summary
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.values import with_values

from .toy import CASE, Scale, ToyMaker, protocol

SCALE = Scale()
MAKER = ToyMaker(SCALE)


def ruler() -> dict:
    return measure(SCALE, SCALE.model_rows)


def made(tmp_path: Path, rules: Protocol, seed: int = 3) -> tuple[Path, Path]:
    folder, sealed = tmp_path / "trials", tmp_path / "truth"
    make(folder, sealed, CASE, rules, MAKER, ruler, seed=seed)
    return folder, sealed


def test_files_say_nothing_of_the_kind(tmp_path: Path) -> None:
    rules = protocol(4, 4, 4, missing=0)
    folder, sealed = made(tmp_path, rules)
    truth = read_json(sealed / TRUTH)["trials"]
    kinds = {t["id"]: t["kind"] for t in truth}
    files = sorted((folder / "trials").iterdir())
    assert {f.stem for f in files} == set(kinds) and Counter(kinds.values())["none"] == 4
    shapes = set()
    for file in files:
        assert file.stat().st_mtime == 0
        lines = file.read_text().splitlines()
        shapes.add(tuple(tuple(line.split(",")[:7]) for line in lines))
        values = [line.split(",")[7] for line in lines[1:]]
        assert all(len(value.replace(".", "")) <= 6 for value in values)
        assert len(read_measurements(file)) == 3 * 16 + 1
    assert len(shapes) == 1  # the same lines in the same order, but for values
    order = [kinds[f.stem] for f in files]
    assert order != sorted(order) and order != sorted(order, reverse=True)
    open_text = "".join(p.read_text() for p in folder.rglob("*") if p.is_file())
    assert "odd_mode" not in open_text and str(read_json(sealed / TRUTH)["seed"]) not in (
        line.strip() for line in open_text.splitlines()
    )


@pytest.mark.slow
def test_members_stand_in_an_order_by_chance_and_values_go_missing(tmp_path: Path) -> None:
    folder, _ = made(tmp_path, protocol(none=40))
    rising, gone = [], Counter[int]()
    for file in (folder / "trials").iterdir():
        readings = read_measurements(file)
        for p in (160.0, 240.0, 320.0):
            here = [r for r in readings if r.label and r.pressure_kPa == p]
            gone[16 - len(here)] += 1
            both = {r.member: r.value for r in here if str(r.label) == "[3,0]"}
            if len(both) == 2:
                rising.append(both["2"] > both["1"])
    assert set(gone) == {0, 1, 2} and min(gone.values()) > 20
    assert 0.3 < np.mean(rising) < 0.7


def test_exchanged_labels_show_in_the_values_alone() -> None:
    """Two doublets within 25 % have each other's values; all modes are in their order, whichever
    values are missing."""
    rules, labels = protocol(none=1, missing=10), [label for label, p in SCALE.rows if p == 160.0]
    (truth,) = draw(rules, CASE, sources(CASE)[0], {}, {}, 1)
    computed = {
        p: MAKER.compute(with_values(CASE, {**truth.variables, "pressure_kPa": p}), labels)
        for p in rules.pressures_kPa
    }
    places = {(p, label): i for i, (p, label) in enumerate(product(computed, labels))}
    exchanged = set()
    for scatter in range(60):
        own = replace(truth, scatter=scatter)
        plain, swapped = (
            readings(Trial(replace(own, swapped=each), 1, computed, computed), rules)
            for each in (False, True)
        )
        assert sorted(r.value for r in plain) == sorted(r.value for r in swapped)
        order = [places[r.pressure_kPa, r.label] for r in swapped]
        assert order == sorted(order)
        was = {r.value: r.label for r in plain}
        pairs = {frozenset((was[r.value], r.label)) for r in swapped if was[r.value] != r.label}
        assert len(pairs) <= 1
        exchanged |= pairs
    assert len(exchanged) > 2
    for a, b in exchanged:
        assert abs(np.subtract(computed[160.0].ln_f[a], computed[160.0].ln_f[b])).max() < 0.26


def test_draws_have_the_stated_distribution() -> None:
    own_sources, _ = sources(CASE)
    truths = draw(protocol(effect=600), CASE, own_sources, MAKER.laws, MAKER.outside, 1)
    sizes = np.array([t.size for t in truths])
    assert sizes.min() >= 0.2 and sizes.max() <= 1.0 and abs(sizes.mean() - 0.6) < 0.03
    counts = Counter(t.law for t in truths)
    assert set(counts) == set(MAKER.laws) and min(counts.values()) > 100
    z = np.array([list(t.constants.values()) for t in truths])
    assert z.shape == (600, len(own_sources)) and abs(z.std() - 1) < 0.02 and abs(z.mean()) < 0.05
    start = next(iter(truths[0].variables))
    ratios = np.array([t.variables[start] for t in truths]) / CASE.case.variables[start].start
    assert ratios.min() > 1 / 1.4 and ratios.max() < 1.4 and ratios.std() > 0.15
    assert 10 < sum(t.swapped for t in truths) < 50


def test_the_seal_holds_the_truth_and_the_answers(tmp_path: Path) -> None:
    folder, sealed = made(tmp_path, protocol(1, 1))
    with pytest.raises(InputError, match="sealed trials already"):
        make(folder, sealed, CASE, protocol(1), MAKER, ruler, seed=3)
    with pytest.raises(InputError, match=r"answers\.json is missing"):
        score(folder, sealed)
    answer(folder, SCALE, SCALE.model_rows)
    assert len(score(folder, sealed)) == 2
    one = sorted((folder / "answers").glob("*.json"))[0]
    before = one.read_text()
    one.write_text(before.replace('"verdict": "', '"verdict": "not '))
    with pytest.raises(InputError, match="changed after they were hashed"):
        score(folder, sealed)
    one.write_text(before)
    text = (sealed / TRUTH).read_text()
    (sealed / TRUTH).write_text(text.replace('"kind": "none"', '"kind": "outside"', 1))
    with pytest.raises(InputError, match="is not the truth that"):
        score(folder, sealed)


def test_the_same_seed_gives_another_seal_but_the_same_trials(tmp_path: Path) -> None:
    (a, _), (b, _) = made(tmp_path / "a", protocol(1, 1)), made(tmp_path / "b", protocol(1, 1))
    assert read_json(a / SEAL) != read_json(b / SEAL)  # a nonce: no truth can be guessed and hashed
    names = [sorted(f.name for f in (x / "trials").iterdir()) for x in (a, b)]
    assert names[0] == names[1]
    assert all((a / "trials" / n).read_bytes() == (b / "trials" / n).read_bytes() for n in names[0])


def test_answering_refuses_where_the_truth_lies_open(tmp_path: Path) -> None:
    folder, sealed = made(tmp_path, protocol(none=1))
    with pytest.raises(InputError, match="must not be in"):
        make(folder / "x", folder / "x" / "truth", CASE, protocol(1), MAKER, ruler)
    (folder / "notes").mkdir()
    (folder / "notes" / TRUTH).write_bytes((sealed / TRUTH).read_bytes())
    with pytest.raises(InputError, match="is open among the trials"):
        answer(folder, SCALE, SCALE.model_rows)


def test_making_goes_on_where_it_was_stopped(tmp_path: Path) -> None:
    whole, _ = made(tmp_path / "whole", protocol(2, 2))
    folder, sealed = tmp_path / "t", tmp_path / "s"

    class Stopped(ToyMaker):
        left = 10

        def compute(self, case, labels):  # type: ignore[no-untyped-def]
            self.left -= 1
            if not self.left:
                raise KeyboardInterrupt
            return super().compute(case, labels)

    stopped = Stopped(SCALE)
    with pytest.raises(KeyboardInterrupt):
        make(folder, sealed, CASE, protocol(2, 2), stopped, ruler, seed=3)
    assert (folder / RULER).exists() and not (folder / SEAL).exists()
    stopped.left = 1000
    make(folder, sealed, CASE, protocol(2, 2), stopped, ruler)
    for file in (whole / "trials").iterdir():
        assert (folder / "trials" / file.name).read_bytes() == file.read_bytes()


@pytest.mark.slow
def test_answers_resume_to_the_same_bytes(tmp_path: Path) -> None:
    folder, _ = made(tmp_path, protocol(2, 1))
    mark = answer(folder, SCALE, SCALE.model_rows)
    files = sorted((folder / "answers").glob("*.json"))
    kept = files[1].stat().st_mtime_ns
    files[0].unlink()
    (folder / ANSWERS).unlink()
    assert answer(folder, SCALE, SCALE.model_rows) == mark
    assert files[1].stat().st_mtime_ns == kept


@pytest.mark.slow
def test_a_whole_study_of_the_toy(tmp_path: Path) -> None:
    folder, sealed = made(tmp_path, protocol(12, 6, 2, swapped=0.0))
    answer(folder, SCALE, SCALE.model_rows)
    trials = score(folder, sealed)
    figures = summary(trials)
    strong = [t for t in trials if t.kind == "effect" and t.band > 25]
    assert len(strong) > 5 and np.mean([t.right for t in strong]) > 0.8
    assert figures["false_alarms"]["right"] <= 1
    assert figures["held_out"]["median_shrinkage"] > 0.3
    assert figures["named_right"]["share"] > 0.8
    words = page(figures, "a toy")
    assert "12 effect, 6 none, 2 outside" in words
    json.dumps(figures, allow_nan=False)


@pytest.mark.slow
def test_the_bundled_maker_s_trial_is_one_that_a_diagnosis_can_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    maker = bundled_maker(CASE, Store(tmp_path / "record"))
    assert "inverse crime" in maker.about and len(maker.laws) >= 20
    folder, sealed = tmp_path / "trials", tmp_path / "truth"
    rules = protocol(1, 1, swapped=0.0)
    make(folder, sealed, CASE, rules, maker, ruler, seed=4)
    for trial in read_json(sealed / TRUTH)["trials"]:
        readings = read_measurements(folder / "trials" / f"{trial['id']}.csv")
        mass = next(r.value for r in readings if r.quantity == "mass_kg")
        assert 8 < mass < 20
        at = {e["pressure_kPa"]: e["ln_f"] for e in trial["with_effect"]}
        for r in readings:
            if r.label:
                ln_f = np.mean(at[r.pressure_kPa][str(r.label)])
                assert abs(np.log(r.value) - ln_f) < 5 * np.hypot(rules.noise, rules.split / 2)
    # the same call again is answered from the record
    monkeypatch.setattr(Bundled, "run", lambda *arguments: pytest.fail("the solver ran again"))
    make(tmp_path / "again", sealed, CASE, rules, maker, ruler)
    for file in (folder / "trials").iterdir():
        assert (tmp_path / "again" / "trials" / file.name).read_bytes() == file.read_bytes()


def test_a_stated_seed_must_be_the_one_that_was_begun_with(tmp_path: Path) -> None:
    sealed = tmp_path / "truth"
    sealed.mkdir()
    write_json(sealed / "seed.json", {"seed": 7})
    with pytest.raises(InputError, match="another seed"):
        make(tmp_path / "t", sealed, CASE, protocol(none=1), MAKER, ruler, seed=8)
