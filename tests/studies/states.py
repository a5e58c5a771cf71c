"""A fit over several states against the truth: coverage, what states add, cost.

    python -m tests.studies.states coverage [data sets] [seed]
    python -m tests.studies.states errors
    python -m tests.studies.states cost [--area]
    python -m tests.studies.states loaded FOLDER

The main case, nine modes at 160, 240 and 320 kPa with the rim fixed and free, sigma 0.5 %, and the
contact area at 4 kN and 240 kPa, sigma 2 %.

coverage: truths are drawn within +-0.3 of ln x about the start, their data with noise; each is
fitted by `calibrate` from the case's own start, and told is how often value +- 1.645 standard
errors holds the truth. What answers is an emulator for each state (60 evaluations on the default
mesh within +-0.9; its error is told) and a quadratic of ln x for the area (14 tyres pressed on the
coarse mesh), as 400 fits on the model would take days. The number of hits is binomial, 360 of 400
with a standard deviation of 6, where all is right: outside 340 to 380 with the probability told.

errors: by the model itself, exact slopes, at the start design: standard errors of all states, over
those of as many repeats of 240 kPa with the rim fixed.

cost: processor time of the fit over all states over the sum of fits of each alone, on the coarse
mesh, by the model itself; with --area the area is one more target of 240 kPa, rim fixed, in both.

loaded: a fit to modes under 4 kN alone, as a user makes it: `modes --load-N` of a truth, scatter of
0.5 %, and `fit --measured`, coarse mesh, three variables; processor time of both.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from scipy.stats import binom

from tests.conftest import CASES
from tests.fit.fake import shape
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import Evaluation, RawMode
from tyrecal.simulate.modes.find import LabelledModes, find_modes
from tyrecal.studies.emulator import Emulator, emulator, spread, up_to
from tyrecal.studies.fit import problem as problem_module
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.studies.footprint import footprint_row
from tyrecal.studies.variable import read_variables
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.case.schema import TargetFootprint, TargetMode, Targets
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import AS_THE_CASE, TyreState
from tyrecal.tyre.values import set_values

from ..solved import calibrate

Array = np.ndarray
Hertz = Mapping[TyreState, Sequence[float]]  # of `LABELS`
CASE = load_case(CASES / "p235_75r17.yaml")
COARSE = with_level(CASE, "coarse")
START = start_values(CASE)
LABELS = target_labels(CASE)
STATES = [TyreState(p, 0.0, rim) for p in (160.0, None, 320.0) for rim in (None, "free")]
RELATIVE_SIGMA, AREA_SIGMA, LOAD_N = 0.005, 0.02, 4000.0
REACH, TRUTHS = 0.9, 0.3  # of ln x: of the emulators, of the truths
PRESSED_DESIGNS = 14
NORMAL_90 = 1.645


def case_with(case: LoadedCase, hertz: Hertz, area_m2: float | None = None) -> LoadedCase:
    """The case with these targets, pressed at 4 kN at once."""
    modes = [
        TargetMode(
            c=label.c,
            m=label.m,
            kind=label.kind,  # type: ignore[arg-type]
            frequency_Hz=f,
            sigma_Hz=RELATIVE_SIGMA * f,
            pressure_kPa=state.pressure_kPa,
            rim=state.rim,
        )
        for state, frequencies in hertz.items()
        for label, f in zip(LABELS, frequencies, strict=True)
    ]
    area = (
        TargetFootprint(load_N=LOAD_N, contact_area_m2=area_m2, sigma_m2=AREA_SIGMA * area_m2)
        if area_m2
        else None
    )
    update = {
        "targets": Targets(modes=modes, footprint=[area] if area else []),
        "road": case.case.road.model_copy(update={"loads_N": [LOAD_N]}),
    }
    return replace(case, case=case.case.model_copy(update=update))


def frequencies(evaluator: Evaluator, state: TyreState, values: Mapping[str, float]) -> list[float]:
    """Frequencies of `LABELS` by the model, Hz."""
    question = Question(state.design(CASE, values))
    ((_, labelled),) = find_modes(evaluator, [question], LABELS)
    assert isinstance(labelled, LabelledModes)
    return [labelled.wanted[label].frequency_Hz for label in LABELS]


def pressed_area(evaluator: Evaluator, values: Mapping[str, float]) -> float:
    """Area by the model, m2, at 4 kN and 240 kPa."""
    pressed = evaluator.press(values, [LOAD_N])
    mesh = TyreDesign(COARSE, values).tyre.mesh
    return float(footprint_row(pressed, pressed.footprints[0], mesh)["area_m2"])


class Area:
    """ln area as a quadratic of ln x."""

    def __init__(self) -> None:
        evaluator = Evaluator(TyreDesign(COARSE))
        self.start = np.log(list(START.values()))
        t = TRUTHS * 2 * spread(PRESSED_DESIGNS, len(START))
        ln = np.log(
            [
                pressed_area(evaluator, dict(zip(START, np.exp(x), strict=True)))
                for x in self.start + t
            ]
        )
        self.powers = up_to(len(START), 2)
        A = self.monomials(t)
        self.coefficients = np.linalg.lstsq(A, ln, None)[0]
        self.rms = float(
            np.std(ln - A @ self.coefficients) * np.sqrt(len(ln) / (len(ln) - A.shape[1]))
        )

    def monomials(self, t: Array) -> Array:
        return np.asarray(np.prod(t[:, None, :] ** self.powers, axis=2))

    def at(self, values: Mapping[str, float]) -> tuple[float, Array]:
        """m2, and slopes by `START`'s variables."""
        x = [values[name] for name in START]
        t = np.log(x) - self.start
        area = float(np.exp(self.monomials(t[None])[0] @ self.coefficients))
        lower = np.maximum(self.powers - np.eye(len(t), dtype=int)[:, None], 0)  # (v, k, v)
        rise = np.einsum("kv,vk,k->v", self.powers, np.prod(t**lower, axis=2), self.coefficients)
        return area, area * rise / x


class EmulatedEvaluator:
    """The emulators of all states in an evaluator's place."""

    solver_name, folder, scheduler, has_gradients = "emulated", None, "", True

    def __init__(self, emulators: Mapping[TyreState, Emulator]):
        self.design = TyreDesign(CASE)
        self.solver: Any = Evaluator(self.design).solver
        self.emulators = {self._key(s.design(CASE, {})): made for s, made in emulators.items()}

    @staticmethod
    def _key(values: Mapping[str, float]) -> tuple[float, bool]:
        return values.get("pressure_kPa", 240.0), bool(values.get("rim.free", False))

    def answer_all(self, questions: Sequence[Question], jobs: int = 1) -> Iterator[Any]:
        for question in questions:
            made = self.emulators.get(self._key(question.values))
            x = np.log([[question.values[name] for name in START]])
            if made is None or (abs(x - made.centre) > made.half + 1e-9).any():
                yield EvaluationFailed("no_results", "no emulator for it")
                continue
            hertz, slopes = np.exp(made.ln_f(x)[0]), made.slopes(x)[0]
            modes = tuple(
                RawMode(float(f), shape(label), 2 if label.c else 1)
                for label, f in zip(made.labels, hertz, strict=True)
                if label in LABELS
            )
            kept = [made.labels.index(label) for label in made.labels if label in LABELS]
            gradients = {
                name: (hertz * slopes[:, j])[kept] / question.values[name]
                for j, name in enumerate(START)
            }
            yield Evaluation(self._key(question.values)[0], 12.8, modes, gradients)

    def needs_road(self, modes: bool = False) -> None:
        """The stand-in has a road."""

    def refuse_lacking(self, design: Any) -> None:
        """Refuse nothing: the stand-in can do everything."""


def coverage(count: int, seed: int) -> None:
    """Print the coverage of 90 % intervals."""
    random = np.random.default_rng(seed)
    variables = read_variables(CASE)
    start = np.log(list(START.values()))
    box = np.stack([start - REACH, start + REACH], 1)
    made = {}
    for state in STATES:
        there = set_values(CASE, state.numbers(CASE))
        made[state] = emulator(Evaluator(TyreDesign(there)), variables, box, LABELS, 60)
        print(f"{state}: stated error {made[state].stated_error:.1e}", flush=True)
    area = Area()
    print(f"area: {area.rms:.2%} off a quadratic", flush=True)
    tyre: Any = EmulatedEvaluator(made)

    def press(
        case: Any,
        evaluator: Any,
        targets: Any,
        values: Mapping[str, float],
        names: Sequence[str],
        *_: Any,
    ) -> tuple[Array, Array]:
        value, slopes = area.at(values)
        return np.array([value]), slopes[None, [list(START).index(name) for name in names]]

    problem_module.press_with_slopes = press
    held, alone = np.zeros(len(START), int), np.zeros(len(START), int)
    ratios, unconverged = [], 0
    for i in range(count):
        truth = start + random.uniform(-TRUTHS, TRUTHS, len(start))
        values = dict(zip(START, np.exp(truth), strict=True))
        noisy = {}
        for state, each in made.items():
            exact = np.exp(each.ln_f(truth[None])[0])[[each.labels.index(x) for x in LABELS]]
            noisy[state] = list(exact * (1 + RELATIVE_SIGMA * random.normal(size=len(exact))))
        measured = area.at(values)[0] * (1 + AREA_SIGMA * random.normal())
        errors = []
        for chosen, hits in ((noisy, held), ({AS_THE_CASE: noisy[AS_THE_CASE]}, alone)):
            result = calibrate(case_with(CASE, chosen, measured), tyre).result
            unconverged += not result["converged"]
            fitted = result["variables"]
            for j, name in enumerate(START):
                off = abs(fitted[name]["value"] - values[name])
                hits[j] += off <= NORMAL_90 * fitted[name]["standard_error"]
            errors.append(fitted["A_carcass"]["standard_error"] / fitted["A_carcass"]["value"])
        ratios.append(errors[0] / (errors[1] / np.sqrt(len(STATES))))
        if (i + 1) % 50 == 0:
            print(f"{i + 1}: all states {held}, one {alone}", flush=True)
    low, high = 340 * count // 400, 380 * count // 400
    false = binom.cdf(low - 1, count, 0.9) + binom.sf(high, count, 0.9)
    for name, of_all, of_one in zip(START, held, alone, strict=True):
        print(f"{name}: {of_all} of {count} intervals hold the truth; of one state {of_one}")
    print(f"{unconverged} of {2 * count} fits did not converge")
    print(f"outside {low} to {high} by chance: {false:.1e} each variable")
    ratio = np.median(ratios)
    print(f"standard error of A_carcass over six repeats' of one state: median {ratio:.3f}")


def errors() -> None:
    """Print what states add, at the start design, by the model."""
    evaluator = Evaluator(TyreDesign(CASE))
    hertz = {state: frequencies(evaluator, state, START) for state in STATES}
    x = np.log(list(START.values()))

    def of(chosen: Hertz) -> Array:
        problem = Problem(case_with(CASE, chosen), evaluator)
        deviations = uncertainty(problem, problem.evaluate(x)).standard_errors
        return np.array(deviations, float) / list(START.values())

    one, every = of({AS_THE_CASE: hertz[AS_THE_CASE]}), of(hertz)
    repeats = one / np.sqrt(len(STATES))
    for name, single, again, all_six in zip(START, one, repeats, every, strict=True):
        print(
            f"{name}: one state {single:.1%}, six repeats of it {again:.1%}, six states"
            f" {all_six:.1%}: {all_six / again:.2f}"
        )


def cost(with_area: bool) -> None:
    """Processor time of all states over the sum of each alone."""
    evaluator = Evaluator(TyreDesign(COARSE))
    truth = dict(zip(START, np.array(list(START.values())) * [1.2, 0.8, 0.8], strict=True))
    random = np.random.default_rng(1)
    exact = {state: frequencies(evaluator, state, truth) for state in STATES}
    hertz = {
        state: [f * (1 + RELATIVE_SIGMA * random.normal()) for f in own]
        for state, own in exact.items()
    }
    area = pressed_area(evaluator, truth) if with_area else None

    def spent(chosen: Hertz, area_m2: float | None) -> tuple[float, int]:
        tyre, began = Evaluator(TyreDesign(COARSE)), time.process_time()
        result = calibrate(case_with(COARSE, chosen, area_m2), tyre).result
        return time.process_time() - began, result["evaluations"]

    spent({AS_THE_CASE: hertz[AS_THE_CASE]}, None)  # modules, templates
    alone = [spent({s: f}, area if s == AS_THE_CASE else None) for s, f in hertz.items()]
    together, points = spent(hertz, area)
    cells = ", ".join(f"{seconds:.2f} s ({count})" for seconds, count in alone)
    print(
        f"alone {cells}; together {together:.2f} s ({points} design points):"
        f" {together / sum(seconds for seconds, _ in alone):.2f} of their sum"
    )


def loaded(folder: Path) -> None:
    """A fit to modes under a load."""
    case, truth = str(CASES / "p235_75r17.yaml"), {"A_carcass": 4e-7, "C10": 9e5}
    sets = [word for name, value in truth.items() for word in ("--set", f"{name}={value}")]
    common = ["--mesh", "coarse", "--no-store", "--quiet"]
    command = ["--load-N", f"{LOAD_N:g}", *sets, *common, "--output", str(folder / "truth")]
    subprocess.run([sys.executable, "-m", "tyrecal", "modes", case, *command], check=True)
    modes = json.loads((folder / "truth" / "modes.json").read_text(encoding="utf-8"))
    rows, scatter = ["quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma"], Random(1)
    for mode in (mode for mode in modes["modes"] if mode["c"] <= 4 and mode["m"] <= 1):
        sigma = RELATIVE_SIGMA * mode["frequency_Hz"]
        place = f"{mode['c']},{mode['m']},{mode['kind'] or ''},{mode['symmetry']},240,{LOAD_N:g}"
        value = mode["frequency_Hz"] + sigma * scatter.gauss(0, 1)
        rows.append(f"frequency_Hz,{place},{value:.3f},{sigma:.3f}")
    table = folder / "loaded.csv"
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    options = ["--measured", str(table), *common, "--no-pictures", "--output", str(folder / "fit")]
    subprocess.run([sys.executable, "-m", "tyrecal", "fit", case, *options], check=True)
    fit = json.loads((folder / "fit" / "fit.json").read_text(encoding="utf-8"))
    count, left = len(rows) - 1, fit["objective_Hz"]
    print(f"{count} modes, {fit['evaluations']} design points, {left:.2f} sigmas left")
    for name, v in fit["variables"].items():
        off = (v["value"] - truth.get(name, v["initial"])) / v["standard_error"]
        percent = 100 * v["standard_error"] / v["value"]
        print(f"{name}: {v['value']:.4g} +- {percent:.0f} %, off by {off:+.1f} standard errors")
    for each in fit["next_states"]:
        print(each)
    print(f"{resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime:.0f} s of both commands")


if __name__ == "__main__":
    what, *rest = sys.argv[1:]
    if what == "coverage":
        numbers = [int(each) for each in rest]
        coverage(*(numbers + [400, 1][len(numbers) :]))
    elif what == "errors":
        errors()
    elif what == "loaded":
        loaded(Path(rest[0]))
    else:
        cost("--area" in rest)
