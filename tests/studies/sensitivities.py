"""Numbers that are off, selected among all uncertain ones, over drawn tyres.

    python -m tests.studies.sensitivities [COUNT] [SEED] >> ../benchmarks/sensitivities.jsonl
    python -m tests.studies.sensitivities ../benchmarks/sensitivities.jsonl

A tyre of a size code, 205/60R15, and the shipped P235/75R17, coarse mesh, exact section: ten modes
at three pressures with 0.2 % of scatter, and the mass. Deviations are drawn linearly through the
exact sensitivities: scatter and error of the model by S, the variables by their spread, and two
numbers off by +-3 of their stated standard deviations, drawn among those with a detectability
lambda above 25 beyond the variables. As many tyres have no number off. A line of JSON is printed
for each tyre: the two numbers, the smaller lambda of them beyond the variables and the other one,
the numbers that are freed in order, and what is not distinguished from each. The second command
counts.

Two numbers that hide each other leave no deviation. So both are counted: all pairs, and pairs of
which each keeps a lambda above 25 beyond the other.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.covariance import covariance
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.studies.sensitivities.selection import Candidates, select_numbers
from tyrecal.tyre.case import with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from ..effects.support import exact
from .wrinkles import by_size

SIZES = ("205/60R15", "P235/75R17")
SHARES, NOISE, OFF, MIN_LAMBDA = (0.75, 1.0, 1.25), 0.002, 3.0, 25.0
LABELS = [
    *(Label(0, 0, kind) for kind in ("axial", "torsional")),
    *(Label(c, m) for c in (1, 2, 3, 4) for m in (0, 1)),
]
Array = np.ndarray


@dataclass(frozen=True)
class Tyre:
    """A tyre to draw deviations of."""

    size: str
    names: list[str]
    plain: Candidates  # without deviations

    @classmethod
    def of(cls, size: str) -> Tyre:
        """The tyre of a size."""
        loaded = load_case(CASES / "p235_75r17.yaml") if size == SIZES[1] else by_size(size)
        case = exact(with_level(loaded, "coarse"))
        pressures = [share * case.case.pressure_kPa for share in SHARES]
        rows = [*((label, p) for p in pressures for label in LABELS), (None, 0.0)]
        known, _ = sources(case)
        model = TyreModel(case, Evaluator(TyreDesign(case)), rows, known, {})
        (answer,) = model.answers([Query(model.start, constants=True)])
        assert isinstance(answer, Answer) and answer.constants is not None
        none = np.full(len(rows), np.nan)
        of = tuple(Observable.of(row) for row in rows)
        observed = Observations(of, answer.eta, np.full(len(of), NOISE), 0.0, none, none)
        nothing = np.zeros((len(of), 0))
        S = covariance(observed, nothing, model.material_laws)
        by_variables = answer.jacobian * model.spread
        whole = S + by_variables @ by_variables.T
        names = [source.name for source in known]
        return cls(size, names, Candidates.of(np.zeros(len(of)), whole, answer.constants))

    def lambdas(self, beyond: int | None = None) -> Array:
        """Detectability (k,) of each number that is off, beyond the variables and another one."""
        G = self.plain.G
        if beyond is not None:
            own = G[:, beyond] / np.linalg.norm(G[:, beyond])
            G = G - np.outer(own, own @ G)
        return np.asarray(OFF**2 * (G**2).sum(0))

    def drawn(self, random: np.random.Generator, off: Sequence[int]) -> dict[str, Any]:
        """A drawn tyre with numbers off, and what is selected."""
        r = random.normal(size=len(self.plain.r))
        for k in off:
            r = r + OFF * random.choice([-1.0, 1.0]) * self.plain.G[:, k]
        candidates = Candidates(r, self.plain.G)
        candidates.__dict__["draws"] = self.plain.draws
        chosen = select_numbers(candidates).numbers
        line: dict[str, Any] = {"size": self.size, "off": [self.names[k] for k in off]}
        if off:
            i, j = off
            line["lambda"] = round(float(min(self.lambdas(j)[i], self.lambdas(i)[j])), 2)
        line["freed"] = [[self.names[k] for k in (each.place, *each.alike)] for each in chosen]
        return line


def study(count: int, seed: int, sizes: Sequence[str] = SIZES) -> Iterator[dict[str, Any]]:
    """As many tyres of each size with two numbers off, and as many sound ones."""
    for size in sizes:
        random = np.random.default_rng([seed, SIZES.index(size)])
        tyre = Tyre.of(size)
        visible = [k for k, each in enumerate(tyre.lambdas()) if each > MIN_LAMBDA]
        pairs = list(combinations(visible, 2))
        for _ in range(count):
            yield tyre.drawn(random, pairs[random.integers(len(pairs))])
        for _ in range(count):
            yield tyre.drawn(random, ())


def is_right(line: dict[str, Any]) -> bool:
    """Whether the two numbers are the first two, or among what is not distinguished from them; of
    a sound tyre, whether nothing is freed."""
    if not line["off"]:
        return not line["freed"]
    i, j = line["off"]
    groups = line["freed"][:2]
    if len(groups) < 2:
        return False
    return (i in groups[0] and j in groups[1]) or (j in groups[0] and i in groups[1])


def table(lines: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Counts by size."""
    heads = "two off: both selected | each visible beyond the other | median group | sound: nothing"
    yield f"| size | {heads} |"
    yield "|---|---|---|---|---|"
    for size in dict.fromkeys(line["size"] for line in lines):
        own = [line for line in lines if line["size"] == size]
        off, sound = [x for x in own if x["off"]], [x for x in own if not x["off"]]
        apart = [line for line in off if line["lambda"] > MIN_LAMBDA]
        groups = [len(group) for line in off for group in line["freed"][:2]]
        cells = [f"{sum(map(is_right, some))} of {len(some)}" for some in (off, apart, sound)]
        median = f"{np.median(groups):g}" if groups else "-"
        yield f"| {size} | {cells[0]} | {cells[1]} | {median} | {cells[2]} |"


def main(arguments: Sequence[str]) -> None:
    """Run the study, or count a record."""
    if arguments and Path(arguments[0]).is_file():
        lines = Path(arguments[0]).read_text().splitlines()
        print("\n".join(table([json.loads(line) for line in lines])))
        return
    count, seed = [*map(int, arguments), *(100, 0)[len(arguments) :]]
    for line in study(count, seed):
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
