"""Trials answered: the diagnosis with what its user would have, and nothing else.

It reads the case, the measurements and the rules; a prediction for the held-out pressure is part of
each answer, so that the scorer alone compares it with what was measured there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import numpy as np

from ...files import Json, private_dir
from ...measured.load import load_case
from ...measured.tables import read_measurements
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.pool import process_pool
from ...tyre.case import LoadedCase
from ..diagnose.diagnosis import Diagnosis, diagnose
from ..diagnose.evidence import NONE
from ..diagnose.posteriors import likeliest
from ..diagnose.result import diagnosis_result
from ..fit.targets import labels_to_measure
from ..inference.effect_ranges import effect_ranges
from ..inference.expansion import Expansion, expand
from ..inference.inverse_problem import Assumed
from ..inference.model import ModelRow, ResponseModel
from ..inference.observations import observe
from ..inference.tyre_model import TyreModel
from ..inference.uncertainties import sources
from .protocol import Protocol, read_protocol, refuse_open_truth, seal_answers, write_json


def rows_of(case: LoadedCase, protocol: Protocol) -> list[ModelRow]:
    """All rows that a model answers: the mass, and each mode at each pressure."""
    modes = labels_to_measure(case)
    return [(None, 0.0), *((label, p) for p in protocol.pressures_kPa for label in modes)]


def tyre_model(
    case: LoadedCase,
    evaluator: Evaluator,
    protocol: Protocol,
    jobs: int = 1,
    effects: Sequence[str] | None = None,
) -> TyreModel:
    """The model of the diagnosis for all trials; effects: their ids, None: the whole catalogue."""
    ranges, _ = effect_ranges(case, evaluator, effects)
    return TyreModel(case, evaluator, rows_of(case, protocol), sources(case)[0], ranges, jobs)


def case_of(folder: Path) -> LoadedCase:
    """The case next to the trials. Raises InputError, CaseError."""
    return load_case(folder / "case" / read_protocol(folder).case, allow_unusual=True)


def one_answer(
    model: ResponseModel, rows: list[ModelRow], protocol: Protocol, known: Expansion, trial: Path
) -> Json:
    """The diagnosis of one file of measurements, and its prediction at the held-out pressure.

    known: the model's expansion about its start, which serves all trials.
    """
    observations = observe(read_measurements(trial), split=protocol.split)
    assumed = Assumed(split=protocol.split)
    diagnosis = diagnose(model, rows, observations, assumed=assumed, known=known, ranked=False)
    return content_of(diagnosis, rows, protocol)


def content_of(diagnosis: Diagnosis, rows: Sequence[ModelRow], protocol: Protocol) -> Json:
    """An answer as plain data."""
    content = diagnosis_result(diagnosis).content()
    content.pop("next_measurements"), content.pop("section_map")  # empty: neither was asked for
    key = content["effect"] or content["likeliest"]
    hertz = partial(predicted, diagnosis, rows, protocol.held_out_kPa)
    return {
        "diagnosis": content,
        "held_out": {
            "pressure_kPa": protocol.held_out_kPa,
            "effect": key,
            "plain_Hz": hertz(NONE),
            "with_effect_Hz": hertz(key) if key else None,
        },
    }


def predicted(
    diagnosis: Diagnosis, rows: Sequence[ModelRow], pressure_kPa: float, key: str
) -> dict[str, float]:
    """Hz by label at a pressure that was not fitted, by a hypothesis at its best parameters."""
    labels = labels_at(diagnosis, rows, pressure_kPa)
    eta = likeliest(diagnosis.problem, diagnosis.hypothesis(key), rows, np.array([*labels]))
    hertz = [round(float(f), 4) for f in np.exp(eta)]
    return dict(zip(labels.values(), hertz, strict=True))


def labels_at(
    diagnosis: Diagnosis, rows: Sequence[ModelRow], pressure_kPa: float
) -> dict[int, str]:
    """The laboratory's own labels of the modes at a pressure, by their places among the rows: the
    diagnosis may have exchanged two."""
    exchanged = diagnosis.exchanged or ()
    own = dict(zip(exchanged, reversed(exchanged), strict=True))
    return {i: str(own.get(x, x)) for i, (x, p) in enumerate(rows) if x and p == pressure_kPa}


def answer(
    folder: Path,
    model: ResponseModel,
    rows: Sequence[ModelRow],
    jobs: int = 1,
    on_progress: Callable[[int, int], None] = lambda done, all: None,
    one: Callable[..., Json] = one_answer,
) -> str:
    """Answer every trial that has no answer yet; returns the sha256 of all answers.

    one: as `one_answer`. Raises InputError where the truth lies among the trials, and what the
    model answers if it has no solution at its start.
    """
    refuse_open_truth(folder)
    protocol = read_protocol(folder)
    trials = sorted((folder / "trials").glob("*.csv"))
    answers = private_dir(folder / "answers")
    waiting = [t for t in trials if not (answers / f"{t.stem}.json").exists()]
    work = partial(one, model, list(rows), protocol, expand(model, model.start))
    before = len(trials) - len(waiting)
    with process_pool(jobs) if jobs > 1 and len(waiting) > 1 else nullcontext() as pool:
        contents = (pool.map if pool else map)(work, waiting)
        for done, (trial, content) in enumerate(zip(waiting, contents, strict=True), before + 1):
            write_json(answers / f"{trial.stem}.json", content)
            on_progress(done, len(trials))
    return seal_answers(folder)
