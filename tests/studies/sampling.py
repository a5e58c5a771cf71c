"""Emulator and draws against the model itself: errors, coverage, cost.

    python -m tests.studies.sampling emulator [designs]
    python -m tests.studies.sampling coverage [data sets] [seed]
    python -m tests.studies.sampling cost [times]

emulator: the main case, default mesh, boxes of +-0.3 and +-0.7 in ln x about the start, 30 and 60
evaluations; fresh designs are drawn, evaluated without slopes and compared, mode by mode.

coverage: designs are drawn within a box of +-0.7, which is also what is known of them beforehand;
their frequencies at 240 kPa are moved by a draw of all that may be off (sigma 0.3 % each, form,
constants) and sampled by 100 000 draws. Told is how often the 90 % intervals hold the design's own
variables, and the frequencies that were not measured, at 192, 240 and 288 kPa. Where all is right,
each is binomial: 360 of 400 with a standard deviation of 6.

cost: processor time of 1e5 draws with all that is not an evaluation, in evaluations with slopes.
"""

from __future__ import annotations

import statistics
import sys
import time
from dataclasses import replace

import numpy as np

from tests.conftest import CASES
from tests.effects.support import exact
from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import Label, labelled
from tyrecal.studies.emulator import emulator
from tyrecal.studies.fit.targets import read_targets
from tyrecal.studies.inference.covariance import alike, covariance, form_error
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.studies.result import StudyInput
from tyrecal.studies.sample.box import sample_box
from tyrecal.studies.sample.posterior import Posterior
from tyrecal.studies.sample.predict import conditional
from tyrecal.studies.sample.study import _answer, rows_of, run
from tyrecal.studies.variable import DesignVariable, read_variables
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import TyreState

Array = np.ndarray
CASE = exact(load_case(CASES / "p235_75r17.yaml"))
VARIABLES = read_variables(CASE)
LABELS = [target.label for target in read_targets(CASE)]
PRESSURES = [192.0, 240.0, 288.0]
RELATIVE_SIGMA = 0.003


def box(reach: float) -> Array:
    """Ends (v, 2) of ln x about the start."""
    x = np.log(list(start_values(CASE).values()))
    return np.stack([x - reach, x + reach], 1)


def errors(count: int) -> None:
    """Print the errors of emulators at fresh designs."""
    evaluator, random = Evaluator(TyreDesign(CASE)), np.random.default_rng(1)
    for reach in (0.3, 0.7):
        x = random.uniform(*box(reach).T, (count, len(VARIABLES)))
        truth = [exact(evaluator, each) for each in x]
        for evaluations in (30, 60):
            made = emulator(evaluator, VARIABLES, box(reach), LABELS, evaluations)
            real = np.array([[each[label] for label in made.labels] for each in truth])
            off = abs(np.exp(made.ln_f(x)) / real - 1)
            beyond = (off.max(1) > made.stated_error).sum()
            print(
                f"+-{reach}: {made.evaluations} evaluations, degree {made.degrees.sum(1).max()}:"
                f" median {np.median(off):.1e}, largest {off.max():.1e}; stated"
                f" {made.stated_error:.1e}, exceeded on {beyond} of {count} designs",
                flush=True,
            )


def exact(evaluator: Evaluator, x: Array) -> dict[Label, float]:
    """Hz by the model."""
    design = {v.name: v.value(float(each)) for v, each in zip(VARIABLES, x, strict=True)}
    return {m.label: m.frequency_Hz for m in labelled(evaluator.evaluate(Question(design)))}


def coverage(count: int, seed: int) -> None:
    """Print the coverage of 90 % intervals."""
    evaluator, random = Evaluator(TyreDesign(CASE)), np.random.default_rng(seed)
    pressure = DesignVariable("pressure_kPa", 240.0, PRESSURES[0], PRESSURES[-1])
    states = np.log(PRESSURES)[:, None]
    whole = np.vstack([box(0.7), states[[0, -1]].T])
    made = emulator(evaluator, [*VARIABLES, pressure], whole, LABELS, 60)
    print(f"emulator: stated error {made.stated_error:.1e}", flush=True)
    measured = tuple(Observable("frequency_Hz", label, 240.0) for label in LABELS)
    every = tuple(Observable("frequency_Hz", x, p) for p in PRESSURES for x in made.labels)
    others = tuple(row for row in every if row not in measured)
    rows = measured + others
    own_sources, _ = sources(CASE)
    model = TyreModel(CASE, evaluator, [(r.label, r.pressure_kPa) for r in rows], own_sources, {})
    g = _answer(model, np.log(list(start_values(CASE).values()))).constants
    assert g is not None
    n, scatter = len(measured), np.full(len(measured), RELATIVE_SIGMA)
    nothing = np.full(n, np.nan)
    observations = Observations(measured, np.zeros(n), scatter, 0.0, nothing, nothing)
    sigma = covariance(observations, g[:n], 0.0)
    form = np.array([form_error(row.label) for row in rows])
    common = np.linalg.cholesky(
        alike(rows) * np.outer(form, form) + g @ g.T + 1e-14 * np.eye(len(rows))
    )
    given = conditional(measured, sigma, g[:n], others, g[n:], 0.0)
    white = np.linalg.inv(np.linalg.cholesky(sigma))
    places = [TyreState(p) for p in PRESSURES]
    labels = [made.labels] * len(places)
    at, beside = (rows_of(each, places, labels) for each in (measured, others))
    first = np.insert(states, 0, 0, axis=1)
    density = Posterior((made,), first, at, np.zeros(n), white, box(0.7))
    held, predicted, linear = np.zeros(3, int), np.zeros(len(others), int), np.zeros(3, int)
    began = time.process_time()
    for i in range(count):
        truth = random.uniform(*box(0.7).T)[None]
        off = common @ random.normal(size=len(rows))
        y = density.ln_f(truth, at)[0] + off[:n] + RELATIVE_SIGMA * random.normal(size=n)
        here = replace(density, y=y)
        sample = sample_box(here, box(0.7), 100_000, i)
        low, high = np.quantile(sample.chains.flat, [0.05, 0.95], axis=0)
        held += (low <= truth[0]) & (truth[0] <= high)
        linear += abs(truth[0] - sample.optima[0]) <= 1.645 * np.sqrt(np.diag(sample.covariance))
        x = sample.chains.thinned
        ln_f = given.drawn(here.ln_f(x, beside), y - here.ln_f(x, at), i)
        low, high = np.quantile(ln_f, [0.05, 0.95], axis=0)
        real = density.ln_f(truth, beside)[0] + off[n:]
        predicted += (low <= real) & (real <= high)
        if (i + 1) % 50 == 0:
            print(f"{i + 1}: {held}, linear {linear}", flush=True)
    print(f"{time.process_time() - began:.0f} s")
    for v, k, by_linear in zip(VARIABLES, held, linear, strict=True):
        print(f"{v.name}: {k} of {count}; linear standard errors {by_linear}")
    for row, k in zip(others, predicted, strict=True):
        print(f"{row}: {k} of {count}")
    print(f"all: {min(*held, *predicted)} to {max(*held, *predicted)}")


def cost(times: int) -> None:
    """Print the cost in evaluations with sensitivities."""
    import_began = time.process_time()
    import emcee  # noqa: F401

    imported = time.process_time() - import_began
    readings = read_measurements(CASES / "p235_75r17_wheeler.csv")
    evaluator = Evaluator(TyreDesign(CASE))
    names = (*(v.name for v in VARIABLES), "pressure_kPa")
    question = Question({**start_values(CASE), "pressure_kPa": 240.0}, names)
    ratios, one = [], []
    answer_all = Evaluator.answer_all
    for _ in range(times):
        began = time.process_time()
        evaluator.evaluate(question)
        one.append(time.process_time() - began)
        spent = 0.0

        def timed(self: Evaluator, *given: object, **more: object) -> object:
            nonlocal spent
            began = time.process_time()
            answers = list(answer_all(self, *given, **more))  # type: ignore[arg-type]
            spent += time.process_time() - began
            return iter(answers)

        Evaluator.answer_all = timed  # type: ignore[assignment,method-assign]
        began = time.process_time()
        sample = run(StudyInput(CASE, evaluator, {}), readings, 100_000)
        rest = time.process_time() - began - spent
        Evaluator.answer_all = answer_all  # type: ignore[method-assign]
        began = time.process_time()
        evaluator.evaluate(question)
        one.append(time.process_time() - began)
        ratios.append(rest / statistics.mean(one[-2:]))
        print(
            f"{sample.drawn.boxes} boxes, {sample.drawn.evaluations} evaluations of them: the rest"
            f" {rest:.2f} s, an evaluation {1e3 * one[-1]:.0f} ms: {ratios[-1]:.1f}",
            flush=True,
        )
    print(f"median {statistics.median(ratios):.1f} evaluations; import of emcee {imported:.2f} s")


if __name__ == "__main__":
    what, *numbers = sys.argv[1:]
    given = [int(number) for number in numbers]
    if what == "emulator":
        errors(*given or [200])
    elif what == "coverage":
        coverage(*(given + [400, 0][len(given) :]))
    else:
        cost(*given or [3])
