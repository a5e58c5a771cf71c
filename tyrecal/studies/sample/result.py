"""Result of a sample: sample.json, sample.csv, its tables and sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from math import ceil
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from ...units import display_unit, printed_unit, printed_value
from ..result import (
    NAME_COLUMNS,
    Column,
    CsvRow,
    Named,
    PositiveNumber,
    Result,
    ResultPart,
    StudyInput,
    Table,
    csv_text,
)
from .box import AT_EDGE
from .chains import ENOUGH, enough_draws
from .predict import variance_shares
from .study import MANY_DRAWS, MAX_EMULATOR_ERROR, Sample, measured_readings, run, states_sampled

Array = np.ndarray
LOW, HIGH = 0.05, 0.95  # quantiles: 90 % lie between
MIN_WIDENED = 0.01  # share that is worth a sentence
NEARLY = 5.0  # of ln p below the highest: another optimum that is worth a word
DENSITY_STEPS, PAIR_STEPS = 40, 30  # of histograms
DIGITS = Column("", ".4g")


class SampledVariable(ResultPart):
    """A design variable, in the unit of the number that it sets."""

    mean: float  # mean of the draws
    median: float  # median of the draws
    low: float  # lower end of the 90 % interval
    high: float  # upper end of the 90 % interval
    standard_error: PositiveNumber  # linear standard error about the best
    best: float  # value where the density is highest
    lower: float  # lower bound
    upper: float  # upper bound
    # shares of draws in equal steps of the box
    density: Annotated[list[float], Field(min_length=1)]
    box: tuple[float, float]  # range of values that was sampled
    log: bool  # whether steps are of the logarithm
    unit: str = ""  # unit of the number that it sets

    @model_validator(mode="after")
    def _within_the_box(self) -> Self:
        low, high = self.box
        if not low < high or (self.log and low <= 0):
            raise ValueError("box must rise, from above 0 on a logarithmic scale")
        slack = 1e-6 * (high - low)
        if not all(low - slack <= x <= high + slack for x in (self.low, self.median, self.high)):
            raise ValueError("low, median and high must be in the box")
        if not low - slack <= self.best <= high + slack:
            raise ValueError("best must be in the box")
        return self


class SampledPair(ResultPart):
    """Two variables together: counts of thinned draws, rows along ``a``, in equal steps."""

    a: str  # name of the first variable
    b: str  # name of the second variable
    # counts of thinned draws, rows along a, in equal steps of both boxes
    counts: list[list[Annotated[int, Field(ge=0, lt=2**31)]]]


class PredictedRow(Named):
    """A frequency of the tyre at a pressure, Hz; ``frequency_Hz`` is its median."""

    pressure_kPa: float
    rim: str | None = None  # how the rim is held, if not as in the case
    low: float  # lower end of the 90 % interval
    high: float  # upper end of the 90 % interval
    mean: float  # mean of the draws
    standard_error: float  # linear standard error
    measured_Hz: float | None = None  # measured frequency
    sigma_Hz: float | None = None  # standard deviation of the measured frequency


class VarianceShare(Named):
    """Sobol' shares of the variance of ln f over the box, see `variance_shares`; ``frequency_Hz``
    is in its middle."""

    deviation_percent: float  # standard deviation of the frequency
    first: dict[str, float]  # by variable alone
    total: dict[str, float]  # by variable, together with others


class Optimum(ResultPart):
    """A design that is likelier than those around it; ``below``: its ln p, below the highest."""

    values: dict[str, float]  # values of the variables
    below: float  # how far its ln p is below the highest


class EmulatorFacts(ResultPart):
    """The emulators of the last box, one a rim; errors are relative, of the worst."""

    evaluations: int  # evaluations in the last box
    failed: int  # evaluations without a solution
    degree: int  # degree of the polynomials
    median_error: float  # median relative error, of the worst emulator
    stated_error: float  # relative error that holds for 99 % of designs
    share_of_sigma: float  # that error over a measured row's standard deviation, the worst one's
    widened: float = 0.0  # share by which it makes that row's standard deviation larger
    boxes: int  # boxes that were tried
    evaluations_of_all: int  # evaluations in all boxes


class ChainFacts(ResultPart):
    """The walkers' draws."""

    draws: int  # draws
    kept: int  # draws in sample_draws.csv
    walkers: int  # walkers
    steps: int  # steps of each walker
    dropped: int  # steps dropped at the beginning
    acceptance: float  # share of steps that were accepted
    autocorrelation: dict[str, float]  # autocorrelation time by variable, in steps
    effective: float  # number of independent draws
    enough: bool  # whether there are enough draws
    at_edge: float  # share of the draws at the edge of the box
    stopped: str  # why the box holds no more of them


class SampleResult(Result):
    """sample.json"""

    study, stem, heading = "sample", "sample", "Sample"
    figures = "tyrecal.report.sample:figures"

    seed: int  # seed of the draws
    variables: dict[str, SampledVariable]  # sampled variables by name
    correlations: dict[str, dict[str, float]]  # correlations of the variables
    predicted: list[PredictedRow]  # predicted frequencies
    emulator: EmulatorFacts  # emulators of the last box
    chains: ChainFacts  # the walkers' draws
    pairs: list[SampledPair]  # joint histograms of two variables
    variance_shares: list[VarianceShare] = Field(default=[])  # at the case's pressure, on its rim
    optima: list[Optimum]  # designs that are likelier than those around them
    uncertain: list[str]  # uncertain numbers that no fit calibrates
    noise_Hz: float | None = None  # standard deviation of a frequency
    # variables of loss factors alone, on which no frequency depends; absent: none
    left_out: list[str] = Field(default=[])

    @classmethod
    def run(
        cls,
        given: StudyInput,
        *,
        measured: Path | None = None,
        draws: int = MANY_DRAWS,
        seed: int = 0,
        at_kPa: Sequence[float] = (),
    ) -> SampleResult:
        """Draw the variables under the case's targets, or under a file of measurements."""
        case, file = given.case, measured or given.case.measured
        readings = measured_readings(case, file)
        drawn = run(given, readings, draws, seed, at_kPa)
        files = [file] if file else []
        return given.stamped(result(drawn, seed), measured=files, **states_sampled(case, readings))

    def quantities(self) -> dict[str, float]:
        numbers = {f"median {name}": each.median for name, each in self.variables.items()}
        for row in self.predicted:
            numbers[f"predicted_Hz {row.pressure_kPa:g} kPa {row.label}"] = row.frequency_Hz
        return numbers

    def shortfall(self) -> tuple[str, str] | None:
        doubts = self.doubts()
        return ("not_sampled", "; ".join(doubts)) if doubts else None

    @model_validator(mode="after")
    def _whole(self) -> Self:
        names = list(self.variables)
        pairs = [(a, b) for i, a in enumerate(names) for b in names[:i]]
        if not names or [(pair.a, pair.b) for pair in self.pairs] != pairs:
            raise ValueError("pairs must be those of the variables")
        if any(np.shape(pair.counts) != (PAIR_STEPS, PAIR_STEPS) for pair in self.pairs):
            raise ValueError(f"counts must be {PAIR_STEPS} by {PAIR_STEPS}")
        return self

    def csv(self) -> str:
        rim = ["rim"] * any(row.rim for row in self.predicted)
        keys = ["c", "m", "kind", "pressure_kPa", *rim, "frequency_Hz", "low", "high", "mean"]
        keys += ["standard_error", "measured_Hz", "sigma_Hz"]
        return csv_text(keys, (row.model_dump() for row in self.predicted))

    def csv_rows(self) -> dict[str, list[CsvRow]]:
        """The variables, without their histograms, and the shares of the variance."""
        apart = {"density", "box", "log"}
        variables: list[CsvRow] = [
            {"variable": name, **v.model_dump(exclude=apart)} for name, v in self.variables.items()
        ]
        shares: list[CsvRow] = [each.model_dump() for each in self.variance_shares]
        return {"variables": variables, "shares": shares}

    def tables(self) -> list[Table]:
        heads = ("variable", "median", "90 % from", "to", "std. err. %", "linear %", "best", "unit")
        rows: list[list[Any]] = []
        for name, v in self.variables.items():
            half = (v.high - v.low) / (2 * 1.645)  # as a standard error, were it normal
            shares = (100 * each / v.median for each in (half, v.standard_error))
            percent = [f"{x:.0f}" if abs(x) >= 10 else f"{x:.2g}" for x in shares]
            unit, factor = display_unit(v.unit)
            median, low, high, best = (
                DIGITS.cell(factor * x) for x in (v.median, v.low, v.high, v.best)
            )
            rows.append([name, median, low, high, *percent, best, printed_unit(unit)])
        tables = [Table([*map(Column, heads)], rows, csv="variables"), *self._predicted()]
        return [*tables, self._shares()] if self.variance_shares else tables

    def _shares(self) -> Table:
        """Shares of the variance in percent: of each variable alone, and of interactions."""
        percent, names = Column("", ".0f", 100), list(self.variables)
        deviation = Column("std. dev. %", ".2g")
        rows = [
            [
                *each.named(),
                deviation.cell(each.deviation_percent),
                *(percent.cell(each.first[name]) for name in names),
                percent.cell(max(1 - sum(each.first.values()), 0.0)),
            ]
            for each in self.variance_shares
        ]
        caption = (
            "percent of the variance of each frequency at the case's pressure, while the variables"
            " are uniform over the emulator's box (sample.json), on a logarithmic scale if they are"
        )
        heads = [*NAME_COLUMNS, deviation, *(Column(name) for name in [*names, "interactions"])]
        return Table(heads, rows, "Shares of the variance", caption, "shares")

    def _predicted(self) -> list[Table]:
        hertz = Column("Hz", ".2f")
        heads = [*NAME_COLUMNS, *map(Column, ("measured", "median", "90 % from", "to", "linear ±"))]
        tables = []
        for state in dict.fromkeys((row.pressure_kPa, row.rim) for row in self.predicted):
            own = [row for row in self.predicted if (row.pressure_kPa, row.rim) == state]
            pressure, rim = state
            rows = [
                [
                    *row.named(),
                    *map(hertz.cell, (row.measured_Hz, row.frequency_Hz, row.low, row.high)),
                    hertz.cell(1.645 * row.standard_error),
                ]
                for row in own
            ]
            held = f", rim {rim}" if rim else ""
            tables.append(Table(heads, rows, f"Hz at {pressure:g} kPa{held}"))
        return tables

    def sentences(self) -> list[str]:
        e, c = self.emulator, self.chains
        sentences = [
            f"{c.draws} draws, equal to {c.effective:.0f} independent ones (autocorrelation"
            f" {max(c.autocorrelation.values()):.1f} steps, {100 * c.acceptance:.0f} % accepted)",
            f"emulator of {e.evaluations} evaluations: off by less than"
            f" {100 * e.stated_error:.2g} % in 99 of 100 designs",
        ]
        if e.widened >= MIN_WIDENED:
            sentences.append(
                "the emulator's error counts as an error of the measurement: it makes the largest"
                f" standard deviation {100 * e.widened:.2g} % larger"
            )
        if self.noise_Hz is not None:
            sentences.append(
                f"the targets state no sigma: {self.noise_Hz:.2f} Hz, as a fit leaves them, is"
                " used instead"
            )
        if self.left_out:
            names = ", ".join(self.left_out)
            sentences.append(f"left out, because no frequency depends on a loss factor: {names}")
        near = [each for each in self.optima if each.below < NEARLY]
        if len(near) > 1:
            sentences.append(
                f"{len(near)} designs are each likelier than those around them, by ln p"
                f" {near[-1].below:.1f} apart: see optima in sample.json"
            )
        return sentences

    def summary(self) -> list[str]:
        ranges = [
            f"{name} {DIGITS.cell(display_unit(v.unit)[1] * v.low)} to"
            f" {printed_value(v.high, v.unit)}"
            for name, v in self.variables.items()
        ]
        return [f"90 % of the draws: {', '.join(ranges)}"]

    def doubts(self) -> list[str]:
        c = self.chains
        doubts = []
        if c.at_edge >= AT_EDGE:
            doubts.append(
                f"{100 * c.at_edge:.2g} % of the draws are at the edge of the box, which could not"
                f" grow: {c.stopped}"
            )
        if not c.enough:
            tau = max(c.autocorrelation.values())
            doubts.append(
                f"{c.steps} steps are fewer than {ENOUGH} autocorrelation times of {tau:.1f}: give"
                f" --draws {ceil(enough_draws(tau) / 1e4) * 10_000} or more"
            )
        if self.emulator.widened > (1 + MAX_EMULATOR_ERROR**2) ** 0.5 - 1:
            doubts.append(
                "the emulator is rough: its error makes a standard deviation of the measurement"
                f" {100 * self.emulator.widened:.2g} % larger"
            )
        return doubts


def result(sample: Sample, seed: int) -> SampleResult:
    """Content of sample.json."""
    drawn, names = sample.drawn, [v.name for v in sample.variables]
    chains, made, box = drawn.chains, drawn.posterior.emulators, drawn.posterior.box
    flat, thin = chains.flat, chains.thinned
    summary = SampleResult(
        format=1,
        seed=seed,
        variables={name: _variable(sample, j) for j, name in enumerate(names)},
        correlations={
            a: dict(zip(names, row, strict=True))
            for a, row in zip(names, np.atleast_2d(np.corrcoef(flat.T)).tolist(), strict=True)
        },
        predicted=_predicted(sample),
        emulator=EmulatorFacts(
            evaluations=sum(each.evaluations for each in made),
            failed=sum(each.failed for each in made),
            degree=max(int(each.degrees.sum(1).max()) for each in made),
            median_error=max(each.median_error for each in made),
            stated_error=max(each.stated_error for each in made),
            share_of_sigma=sample.rough,
            widened=sample.widened,
            boxes=drawn.boxes,
            evaluations_of_all=drawn.evaluations,
        ),
        chains=ChainFacts(
            draws=len(flat),
            kept=len(thin),
            walkers=chains.draws.shape[1],
            steps=len(chains.draws),
            dropped=chains.dropped,
            acceptance=chains.acceptance,
            autocorrelation=dict(zip(names, chains.tau.tolist(), strict=True)),
            effective=chains.effective,
            enough=chains.enough,
            at_edge=float(drawn.at_edge.sum()),
            stopped=drawn.stopped,
        ),
        pairs=[
            SampledPair(
                a=names[i],
                b=names[j],
                counts=np.histogram2d(thin[:, i], thin[:, j], PAIR_STEPS, box[[i, j]])[0]
                .astype(int)
                .tolist(),
            )
            for i in range(len(names))
            for j in range(i)
        ],
        variance_shares=_shares(sample),
        optima=[
            Optimum(
                values={
                    v.name: v.value(float(xi)) for v, xi in zip(sample.variables, x, strict=True)
                },
                below=float(drawn.height[0] - height),
            )
            for x, height in zip(drawn.optima, drawn.height, strict=True)
        ],
        uncertain=[source.words for source in sample.sources if source.words],
        noise_Hz=sample.noise_Hz,
    )
    if sample.left_out:
        summary = summary.model_copy(update={"left_out": [*sample.left_out]})
    return summary.with_files({"sample_draws.csv": draws_csv(sample)})


def _shares(sample: Sample) -> list[VarianceShare]:
    """Shares by the last box's emulator of the case's own rim, at the case's pressure."""
    emulator, names = sample.drawn.posterior.emulators[0], [v.name for v in sample.variables]
    if others := emulator.variables[len(names) :]:
        emulator = emulator.restricted(np.array([v.scaled(v.start) for v in others]))
    first, total, variance = variance_shares(emulator)
    hertz = np.exp(emulator.ln_f(emulator.centre[None])[0])
    by_name = lambda shares: dict(zip(names, shares.tolist(), strict=True))
    return [
        VarianceShare(
            **asdict(label),
            frequency_Hz=float(hertz[i]),
            deviation_percent=float(100 * np.sqrt(variance[i])),
            first=by_name(first[i]),
            total=by_name(total[i]),
        )
        for i, label in enumerate(emulator.labels)
    ]


def draws_csv(sample: Sample) -> str:
    """The thinned draws as CSV: a column a variable, in its own unit."""
    columns = [_values(v.log, v.lower, v.upper, x) for v, x in _thinned(sample)]
    names = [v.name for v in sample.variables]
    table = np.column_stack(columns).tolist()
    return csv_text(names, (dict(zip(names, row, strict=True)) for row in table))


def _thinned(sample: Sample) -> list[tuple[Any, Array]]:
    return list(zip(sample.variables, sample.drawn.chains.thinned.T, strict=True))


def _values(log: bool, lower: float, upper: float, x: Array) -> Array:
    """A variable's values (d,), in its own unit, from its coordinates x (d,)."""
    return np.exp(x) if log else lower + x * (upper - lower)


def _variable(sample: Sample, j: int) -> SampledVariable:
    """The sampled variable j: quantiles, standard error, best value and correlations."""
    v, drawn = sample.variables[j], sample.drawn
    x, ends = drawn.chains.flat[:, j], drawn.posterior.box[j]
    values = _values(v.log, v.lower, v.upper, x)
    low, median, high = np.quantile(values, [LOW, 0.5, HIGH]).tolist()
    best = v.value(float(drawn.optima[0, j]))
    return SampledVariable(
        mean=float(values.mean()),
        median=median,
        low=low,
        high=high,
        standard_error=float(np.sqrt(drawn.covariance[j, j])) * v.slope(best),
        best=best,
        lower=v.lower,
        upper=v.upper,
        density=(np.histogram(x, DENSITY_STEPS, tuple(ends))[0] / len(x)).tolist(),
        box=tuple(_values(v.log, v.lower, v.upper, ends).tolist()),
        log=v.log,
        unit=sample.units[j],
    )


def _predicted(sample: Sample) -> list[PredictedRow]:
    """Measured and predicted frequency of each row, with quantiles of the draws."""
    measured = {
        (row.label, row.state): (float(np.exp(y)), float(scatter * np.exp(y)))
        for row, y, scatter in zip(
            sample.observations.rows,
            sample.observations.y,
            sample.observations.scatter,
            strict=True,
        )
    }
    hertz = np.exp(sample.ln_f)
    low, median, high = np.quantile(hertz, [LOW, 0.5, HIGH], axis=0)
    rows = []
    for i, row in enumerate(sample.rows):
        value, sigma = measured.get((row.label, row.state), (None, None))
        assert row.label
        rows.append(
            PredictedRow(
                c=row.label.c,
                m=row.label.m,
                kind=row.label.kind,
                pressure_kPa=row.pressure_kPa,
                **({"rim": row.rim} if row.rim else {}),
                frequency_Hz=float(median[i]),
                low=float(low[i]),
                high=float(high[i]),
                mean=float(hertz[:, i].mean()),
                standard_error=float(sample.linear[i] * median[i]),
                measured_Hz=value,
                sigma_Hz=sigma,
            )
        )
    return rows
