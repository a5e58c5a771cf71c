"""Standard errors that a fit states, tested over drawn tyres.

    python -m tests.studies.fit_errors [--prior] [COUNT] [SEED] [SIZE ...] >> fit_errors.jsonl
    python -m tests.studies.fit_errors --few [COUNT] [SEED] [SIZE ...] >> fit_errors.jsonl
    python -m tests.studies.fit_errors fit_errors.jsonl

Each tyre is drawn as its case states what is uncertain: fields of the section, constants, material
laws, and 0.3 % of scatter of each frequency at two pressures. Its variables are drawn within 20 %
of the start, coarse mesh. `fit`, or `fit --prior`, is then given the case as it is. A line of JSON
is printed for each tyre: (fitted - truth) over standard_error and over standard_error_total of each
variable, apart where the fit says that the total does not hold, and (predicted - true) over the
stated error of each mode at the case's own pressure, which was not measured. With `--few`, which
is `--prior` with 1 to 6 of these 18 frequencies in turn, the case knows its variables to 15 %, and
the tyre's are drawn so. The last command
prints by size and variable or mode how often the 90 % interval, +- 1.645 errors, holds the truth,
and the root mean squares; a record may be of several runs.

Of 100 tyres a true 90 % interval holds 84 to 95 in 90 % of such studies.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.find import LabelledModes, find_modes
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.fit.prediction import FitResponses, predicted_errors
from tyrecal.studies.fit.result import FitResult
from tyrecal.studies.inference.covariance import MATERIAL_LAWS, by_laws
from tyrecal.studies.inference.observations import Observable
from tyrecal.studies.inference.section_fields import fields, with_fields
from tyrecal.studies.inference.uncertainties import sources, values_of
from tyrecal.studies.variable import read_variable
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.case.schema import TargetMode, Targets
from tyrecal.tyre.effects.edit import changed
from tyrecal.tyre.load import load_case
from tyrecal.tyre.number_units import EFFECT_PATH
from tyrecal.tyre.values import with_values

from ..conftest import CASES
from ..solved import calibrate
from .wrinkles import by_size

SIZES = ("P235/75R17", "205/60R15", "225/45R17")
NOISE, WITHIN, SHARES, QUANTILE_90 = 0.003, 0.2, (0.85, 1.15), 1.645
FEW, KNOWN_PERCENT = 6, 15.0
NOT_HELD = ", said not to hold"
LABELS = [
    *(Label(0, 0, kind) for kind in ("axial", "torsional")),
    *(Label(c, m) for c, m in ((1, 0), (1, 1), (2, 0), (2, 1), (3, 0), (3, 1), (4, 0))),
]


def case_of(size: str) -> LoadedCase:
    """The shipped case, or that of a size code, on its coarse mesh."""
    case = load_case(CASES / "p235_75r17.yaml") if size == SIZES[0] else by_size(size)
    return with_level(case, "coarse")


def frequencies(case: LoadedCase, values: dict[str, float], pressures: Sequence[float]) -> list:
    """Hz of `LABELS` at each pressure. Raises EvaluationFailed."""
    evaluator, hertz = Evaluator(TyreDesign(case)), []
    questions = [Question({**values, "pressure_kPa": p}) for p in pressures]
    for _, answer in sorted(find_modes(evaluator, questions, lambda *_: LABELS, 1)):
        if not isinstance(answer, LabelledModes):
            raise answer
        hertz += [answer.wanted[label].frequency_Hz for label in LABELS]
    return hertz


@dataclass(frozen=True)
class DrawnTyre:
    """A tyre as it may be: case with all its numbers and its section, and its variables;
    pressure_off: of every pressure that is read, kPa."""

    case: LoadedCase
    truth: dict[str, float]
    pressure_off: float

    def frequencies(self, pressures_kPa: Sequence[float]) -> list[float]:
        """Hz of `LABELS` where the gauge reads each pressure. Raises EvaluationFailed."""
        return frequencies(self.case, {}, [p + self.pressure_off for p in pressures_kPa])


def knowing(case: LoadedCase) -> LoadedCase:
    """The case, its variables known to `KNOWN_PERCENT`."""
    known = {"percent": KNOWN_PERCENT}
    own = {name: each.model_copy(update=known) for name, each in case.case.variables.items()}
    return changed(case, variables=own)


def drawn_tyre(case: LoadedCase, random: np.random.Generator, few: bool = False) -> DrawnTyre:
    """A tyre of a case, off it as its case states what is uncertain; with ``few`` its variables,
    too."""
    truth = {
        name: value * float(np.exp(random.uniform(-WITHIN, WITHIN)))
        if not few
        else value * float(np.exp(read_variable(case, name).spread * random.normal()))
        for name, value in start_values(case).items()
    }
    known, _ = sources(case)
    own, off = values_of(case, known), dict[str, float]()
    pressure_off = 0.0
    for source in known:
        amount = float(random.normal())
        for path, step in source.steps.items():
            if path == "pressure_kPa":
                pressure_off = amount * step
            elif path.startswith(EFFECT_PATH):
                off[path] = amount * step
            else:
                off[path] = own[path] + amount * step
    own_numbers = with_values(case, {**truth, **off})  # before compounds part by region
    tyre = with_fields(own_numbers, {name: float(random.normal()) for name in fields(case)})
    return DrawnTyre(tyre, truth, pressure_off)


def measured_and_own(
    case: LoadedCase, tyre: DrawnTyre, random: np.random.Generator
) -> tuple[LoadedCase, list[float]]:
    """The case with what the tyre measures as its targets, and its frequencies (Hz) at the case's
    pressure, which depart from the model's by the same material laws."""
    nominal = case.case.pressure_kPa
    pressures = [*(share * nominal for share in SHARES), nominal]
    rows = tuple(Observable("frequency_Hz", label, p) for p in pressures for label in LABELS)
    root = np.linalg.cholesky(by_laws(rows) + 1e-9 * np.eye(len(rows)))
    own = np.array(tyre.frequencies(pressures)) * np.exp(
        MATERIAL_LAWS * root @ random.normal(size=len(rows))
    )
    count = len(SHARES) * len(LABELS)
    read = own[:count] * np.exp(NOISE * random.normal(size=count))
    modes = [
        TargetMode(
            c=row.label.c,
            m=row.label.m,
            kind=row.label.kind,  # type: ignore[arg-type]
            frequency_Hz=f,
            sigma_Hz=NOISE * f,
            pressure_kPa=row.pressure_kPa,
        )
        for row, f in zip(rows, read, strict=False)
        if row.label
    ]
    return changed(case, targets=Targets(modes=modes)), own[count:].tolist()


def drawn(case: LoadedCase, random: np.random.Generator) -> tuple[LoadedCase, dict[str, float]]:
    """The case with what a drawn tyre measures as its targets, and the tyre's variables."""
    tyre = drawn_tyre(case, random)
    return measured_and_own(case, tyre, random)[0], tyre.truth


def predictions(
    case: LoadedCase, evaluator: Evaluator, fit: FitResult
) -> list[tuple[float, float]]:
    """Hz and relative standard error of `LABELS` at the case's pressure by the fitted design."""
    values, nominal = {n: v.value for n, v in fit.variables.items()}, case.case.pressure_kPa
    known = FitResponses(responses=fit.responses, chi2_per_dof=fit.chi2_per_dof, prior=fit.prior)
    wanted = [(label, nominal) for label in LABELS]
    errors = predicted_errors(case, evaluator, values, known, wanted)
    return list(zip(frequencies(case, values, [nominal]), errors.tolist(), strict=True))


def line_of(
    case: LoadedCase, random: np.random.Generator, prior: bool, few: int = 0
) -> dict[str, Any]:
    """Errors of one drawn tyre's fit, to ``few`` frequencies if not 0, over those that it states.
    Raises EvaluationFailed, or ValueError for a tyre that cannot be drawn."""
    tyre = drawn_tyre(case, random, few > 0)
    measured, own = measured_and_own(case, tyre, random)
    if few:
        rows = random.choice(len(measured.case.targets.modes), few, replace=False)
        modes = [measured.case.targets.modes[i] for i in sorted(rows)]
        measured = changed(measured, targets=Targets(modes=modes))
    evaluator = Evaluator(TyreDesign(measured))
    fit = calibrate(measured, evaluator, "gauss-newton", prior=prior).found
    variables = {}
    for name, v in fit.variables.items():
        if v.at_bound or not v.standard_error or not v.standard_error_total:
            continue
        off = np.log(v.value / tyre.truth[name]) * v.value
        ratios = [off / v.standard_error, off / v.standard_error_total]
        variables[name if v.total_holds else name + NOT_HELD] = [shortened(x) for x in ratios]
    held = {}
    if not few and not any(v.at_bound for v in fit.variables.values()):
        predicted = predictions(measured, evaluator, fit)
        held = {
            str(label): shortened(float(np.log(computed / f)) / error)
            for label, f, (computed, error) in zip(LABELS, own, predicted, strict=True)
        }
    chi2 = fit.chi2_per_dof and shortened(fit.chi2_per_dof)
    return {"chi2_per_dof": chi2, "variables": variables, "modes": held}


def shortened(x: float) -> float:
    """Four digits, of which the table has three."""
    return float(f"{x:.4g}")


def table(lines: Sequence[dict[str, Any]]) -> Iterator[str]:
    """The table of results."""
    yield "| size | variable or mode | held in 90 % | rms by scatter | rms by total |"
    yield "|---" * 5 + "|"
    kind = lambda line: (
        line["size"] + ", --prior" * bool(line.get("prior")) + ", few" * bool(line.get("few"))
    )
    for size in dict.fromkeys(map(kind, lines)):
        own = [line for line in lines if kind(line) == size]
        rows: dict[str, list[tuple[float, float]]] = {}
        for line in own:
            for name, (by_scatter, by_total) in line["variables"].items():
                rows.setdefault(name, []).append((by_scatter, by_total))
            for name, by_total in line["modes"].items():
                rows.setdefault(name, []).append((np.nan, by_total))
                rows.setdefault("all modes", []).append((np.nan, by_total))
        for name, each in rows.items():
            scatter, total = np.array(each).T
            held = int((abs(total) <= QUANTILE_90).sum())
            rms = [
                "" if np.isnan(x).all() else f"{np.sqrt(np.mean(x**2)):.2f}"
                for x in (scatter, total)
            ]
            yield f"| {size} | {name} | {held} of {len(each)} | {rms[0]} | {rms[1]} |"
        chi2 = np.mean([line["chi2_per_dof"] or np.nan for line in own])
        yield f"{size}: {len(own)} tyres, chi2/dof {chi2:.2f} on average"


def main(count: int, seed: int, sizes: Sequence[str], prior: bool, is_few: bool) -> None:
    """Print the lines, and the table to stderr."""
    lines = []
    for size in sizes:
        case, random = case_of(size), np.random.default_rng([seed, SIZES.index(size)])
        case = knowing(case) if is_few else case
        done = 0
        while done < count:
            few = is_few * (1 + done % FEW)
            try:
                line = line_of(case, random, prior, few)
            except (EvaluationFailed, ValueError):  # the next tyre is drawn
                continue
            done += 1
            own = {"size": size, "seed": seed, "number": done, **({"prior": True} if prior else {})}
            own |= {"few": few} if few else {}
            lines.append({**own, **line})
            print(json.dumps(lines[-1]), flush=True)
    print("\n".join(table(lines)), file=sys.stderr)


if __name__ == "__main__":
    if sys.argv[1:] and Path(sys.argv[1]).is_file():
        print("\n".join(table([json.loads(x) for x in Path(sys.argv[1]).read_text().splitlines()])))
    else:
        words = [word for word in sys.argv[1:] if not word.startswith("--")]
        is_few = "--few" in sys.argv
        given = [int(x) for x in words[:2]]
        count, seed = [*given, *(100, 1)[len(given) :]]
        main(count, seed, words[2:] or SIZES, is_few or "--prior" in sys.argv, is_few)
