"""Standard errors of `fit` against those of `sample` and `diagnose` of the same drawn tyres.

    python -m tests.studies.standard_errors [COUNT] [SEED] [SAMPLED] [DIAGNOSED] [SIZE ...]
    python -m tests.studies.standard_errors --prior COUNT SEED SAMPLED [SIZE ...] >> record.jsonl
    python -m tests.studies.standard_errors record.jsonl

Tyres as in `fit_errors`, COUNT of each size, with SAMPLED and DIAGNOSED of them. The fit weighs
residuals by their scatter alone, R = (J^T S^-1 J)^-1 J^T S^-1, and `sample` and `diagnose` by the
whole covariance Sigma of ln q, R' = (J^T Sigma^-1 J)^-1 J^T Sigma^-1. About one design

    R Sigma R^T = (J^T Sigma^-1 J)^-1 + (R - R') Sigma (R - R')^T,

so the fit's total is never the smaller one, and equal to theirs only if R = R'. Printed by size and
variable: the mean of total over the error by Sigma, and the largest departure from this equation;
then of single tyres by how much `sample` (linear, and a 90 % interval over 3.29) and `diagnose`
depart from the error by Sigma. That of `diagnose` also knows how far a variable may be off its
start (`DesignVariable.spread`), which is part of the error it is compared with. Totals are as long
as chi2 per degree of freedom is below 1; else `fit` scales them.

`fit --prior` weighs by the whole covariance and by what is known before, as `diagnose` does;
`sample` knows bounds alone, so what is known before is added to its results here. Lines have for
each variable the total over the error of `diagnose`, and of the tyres that are sampled over that of
`sample`, linear and by draws (a 90 % interval over 3.29), each of ln of the variable at its own
likeliest design; `clear` where the interval keeps a tenth of the range from both bounds. The third
command counts a record.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tyrecal.measured.measurement import measurements_csv
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.diagnose import study as diagnosis
from tyrecal.studies.diagnose.posteriors import calibrated_variables
from tyrecal.studies.fit.problem import Point, Problem
from tyrecal.studies.fit.total_error import TotalError, total_error
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.studies.result import StudyInput
from tyrecal.studies.sample.study import run as sample
from tyrecal.studies.variable import read_variable
from tyrecal.tyre.case import LoadedCase

from ..solved import calibrate
from .fit_errors import QUANTILE_90, SIZES, case_of, drawn
from .slips import table_of

Array = np.ndarray
DRAWS = 4000
CHEAPEST = ("rim_width",)  # effects of a diagnosis whose variables without an effect are read


@dataclass(frozen=True)
class BothErrors:
    """Covariances (v, v) of the fitted coordinates: total of the fit, by the whole covariance, and
    what the closed form adds to that."""

    total: Array
    by_sigma: Array
    added: Array

    @property
    def departure(self) -> float:
        """Relative departure from the closed form."""
        own = np.sqrt(np.outer(np.diag(self.total), np.diag(self.total)))
        return float(abs((self.total - self.by_sigma - self.added) / own).max())


def both_errors(problem: Problem, point: Point, total: TotalError) -> BothErrors:
    """The two covariances at a fitted point."""
    sensitivities, scatter = relative(problem, point)
    return compared(sensitivities, scatter, total.of_values, total.of_coordinates)


def relative(problem: Problem, point: Point) -> tuple[Array, Array]:
    """d ln q / d x (n, v) of the targets that count, and S^(1/2) (n,), by which the fit weighs
    them; a doublet counts twice."""
    scale = problem.scale[problem.scale > 0]
    hertz = np.array([point.states[t.state][t.label].frequency_Hz for t in problem.targets])
    own = point.jacobian / problem.scale[:, None] / hertz[:, None]
    return own, 1 / (scale * hertz)


def compared(J: Array, scatter: Array, sigma: Array, total: Array) -> BothErrors:
    """J (n, v), scatter (n,) by which the fit weighs, Sigma (n, n), and its total (v, v)."""
    weighted = J / scatter[:, None] ** 2
    R = np.linalg.solve(J.T @ weighted, weighted.T)
    by_sigma = np.linalg.inv(J.T @ np.linalg.solve(sigma, J))
    apart = R - by_sigma @ np.linalg.solve(sigma, J).T
    return BothErrors(total, by_sigma, apart @ sigma @ apart.T)


def sampled_errors(case: LoadedCase, seed: int) -> tuple[Array, Array]:
    """Standard deviations (v,) of x by `sample`: linear, and of its draws."""
    result = sample(StudyInput(case, Evaluator(TyreDesign(case)), {}), None, DRAWS, seed)
    low, high = np.quantile(result.drawn.chains.flat, [0.05, 0.95], axis=0)
    return np.sqrt(np.diag(result.drawn.covariance)), (high - low) / (2 * QUANTILE_90)


def diagnosed_errors(case: LoadedCase) -> Array:
    """Standard deviations (v,) of ln of each variable by `diagnose`, without an effect."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "measured.csv")
        file.write_text(measurements_csv(table_of(case)))
        made = diagnosis.study(case, Evaluator(TyreDesign(case)), file, effects=list(CHEAPEST))
    own = calibrated_variables(made.diagnosis, made.model)["without"].values()
    return np.array([each["standard_error"] / each["value"] for each in own])


def prior_line(case: LoadedCase, seed: int, sampled: bool) -> dict[str, Any]:
    """Totals of a fit with what is known before over the errors of the others, by variable."""
    fit = calibrate(case, Evaluator(TyreDesign(case)), "gauss-newton", prior=True).found
    errors = {"diagnose": diagnosed_errors(case)}
    if sampled:
        errors |= known_before(case, seed)
    clear = errors.pop("clear", None)
    line: dict[str, Any] = {"chi2_per_dof": fit.chi2_per_dof, "variables": {}}
    for i, (name, own) in enumerate(fit.variables.items()):
        total = (own.standard_error_total or np.nan) / own.value
        ratios = {other: round(float(total / each[i]), 4) for other, each in errors.items()}
        flags = {} if clear is None else {"clear": bool(clear[i])}
        line["variables"][name] = {"at_bound": own.at_bound, **ratios, **flags}
    return line


def known_before(case: LoadedCase, seed: int) -> dict[str, Array]:
    """Errors (v,) of ln of each variable by `sample` and what is known before, linear and by draws;
    clear (v,): whether their 90 % interval keeps a tenth of the range from both bounds."""
    result = sample(StudyInput(case, Evaluator(TyreDesign(case)), {}), None, DRAWS, seed)
    variables = [read_variable(case, name) for name in case.case.variables]
    mean, sd = np.array([[v.scaled(v.start), v.spread] for v in variables]).T
    linear = np.linalg.inv(np.linalg.inv(result.drawn.covariance) + np.diag(sd**-2))
    x = result.drawn.chains.flat
    weights = np.exp(-(((x - mean) / sd) ** 2).sum(1) / 2)
    low, high = np.quantile(x, [0.05, 0.95], axis=0, weights=weights, method="inverted_cdf")
    lower, upper = np.array([[v.scaled(v.lower), v.scaled(v.upper)] for v in variables]).T
    margin = (upper - lower) / 10
    return {
        "linear": np.sqrt(np.diag(linear)),
        "draws": (high - low) / (2 * QUANTILE_90),
        "clear": (lower + margin < low) & (high < upper - margin),
    }


def prior_lines(count: int, seed: int, sampled: int, sizes: Sequence[str]) -> None:
    """Print the lines of the fits with what is known before, and their table to stderr."""
    lines = []
    for size in sizes:
        case, random = case_of(size), np.random.default_rng([seed, SIZES.index(size), 5])
        number = 0
        while number < count:
            try:
                line = prior_line(drawn(case, random)[0], number + 1, number < sampled)
            except (EvaluationFailed, ValueError):  # the next tyre is drawn
                continue
            number += 1
            lines.append({"size": size, "seed": seed, "number": number, **line})
            print(json.dumps(lines[-1]), flush=True)
    print("\n".join(prior_table(lines)), file=sys.stderr)


def prior_table(lines: Sequence[dict[str, Any]]) -> Iterator[str]:
    """How many of the ratios are within 5 % (by draws 15 %) of 1, and the farthest."""
    yield "| total of `fit --prior` over the error of | within | variables | farthest |"
    yield "|---" * 4 + "|"
    own = [each for line in lines for each in line["variables"].values() if not each["at_bound"]]
    for name, limit, need in (
        ("diagnose", 0.05, None),
        ("linear", 0.05, None),
        ("draws", 0.15, True),
        ("draws", 0.15, False),
    ):
        ratios = [e[name] for e in own if name in e and (need is None or e["clear"] is need)]
        if ratios:
            where = {None: "", True: ", clear of bounds", False: ", next to a bound"}[need]
            within = sum(abs(ratio - 1) <= limit for ratio in ratios)
            farthest = max(ratios, key=lambda ratio: abs(np.log(ratio)))
            yield f"| {name}{where} | {limit:.0%} | {within} of {len(ratios)} | {farthest:.2f} |"


def main(count: int, seed: int, sampled: int, diagnosed: int, sizes: Sequence[str]) -> None:
    """Print the table, and a line for each tyre that is sampled or diagnosed."""
    print("| size | variable | total / by Sigma | least | largest | closed form within |")
    print("|---" * 6 + "|")
    for size in sizes:
        case, random = case_of(size), np.random.default_rng([seed, SIZES.index(size), 3])
        ratios: dict[str, list[float]] = defaultdict(list)
        departure, tyre = 0.0, 0
        while tyre < count:
            try:
                measured, _ = drawn(case, random)
                evaluator = Evaluator(TyreDesign(measured))
                fit = calibrate(measured, evaluator, "gauss-newton")
                problem = Problem(measured, evaluator)
                total = total_error(problem, fit.fitted, uncertainty(problem, fit.fitted))
            except (EvaluationFailed, ValueError):
                continue
            tyre += 1
            both = both_errors(problem, fit.fitted, total)
            departure = max(departure, both.departure)
            ratio = np.sqrt(np.diag(both.total) / np.diag(both.by_sigma))
            for each, value in zip(problem.variables, ratio, strict=True):
                ratios[each.name].append(float(value))
            by_sigma = np.sqrt(np.diag(both.by_sigma))
            if tyre <= sampled:
                linear, of_draws = sampled_errors(measured, tyre)
                print(f"{size} {tyre} sample: {linear / by_sigma} {of_draws / by_sigma}")
            if tyre <= diagnosed:
                prior = np.diag([v.spread**-2 for v in problem.variables])
                known = np.linalg.inv(np.linalg.inv(both.by_sigma) + prior)
                own = diagnosed_errors(measured) / np.sqrt(np.diag(known))
                print(f"{size} {tyre} diagnose: {own}", flush=True)
        for name, values in ratios.items():
            print(
                f"| {size} | {name} | {np.mean(values):.2f} | {min(values):.2f} |"
                f" {max(values):.2f} | {departure:.1e} |",
                flush=True,
            )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--prior"]:
        numbers = [int(x) for x in sys.argv[2:5]]
        prior_lines(numbers[0], numbers[1], numbers[2], sys.argv[5:] or SIZES)
    elif sys.argv[1:] and Path(sys.argv[1]).is_file():
        record = Path(sys.argv[1]).read_text().splitlines()
        print("\n".join(prior_table([json.loads(line) for line in record])))
    else:
        numbers = [int(x) for x in sys.argv[1:5]]
        main(*[*numbers, *(10, 1, 3, 3)[len(numbers) :]], sys.argv[5:] or SIZES)  # type: ignore
