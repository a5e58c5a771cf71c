"""Chance in tests: draws from one seed, and claims about draws that fail falsely at a stated rate.

Every draw of a test comes from ``generator``, so that ``pytest --seed N`` draws all of them anew;
what a test asserts holds for any seed. What holds for most draws only is a claim about their
number or distribution: a test takes the fixture ``chance`` and claims through it. Each claim fails
falsely with a probability of RATE at most; the test's docstring states their sum, ``False
failures: 2e-7.``, which is checked when the test ends. ``python -m tests.chance`` lists all, and
``tests/test_selection.py`` holds their sum against LIMIT.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from math import log, sqrt
from pathlib import Path
from zlib import crc32

import numpy as np

Array = np.ndarray
RATE = 1e-7  # of one claim
LIMIT = 1e-4  # of the whole suite
STATED = re.compile(r"False failures: (\d+(?:\.\d+)?e-\d+)\.")

seed = 0  # set by conftest.py


def generator(*key: int | str) -> np.random.Generator:
    """Draws that the suite's seed and a key fix."""
    return np.random.default_rng(
        [seed, *(crc32(k.encode()) if isinstance(k, str) else k for k in key)]
    )


class Chance:
    """Claims of one test. random: its draws; spent: the false-failure rate of its claims so far."""

    def __init__(self, name: str) -> None:
        self.random = generator(name)
        self.spent = 0.0
        self.seen: list[tuple[int, int, float, float]] = []  # hits, trials, low, high

    def often(self, hits: Sequence[bool] | Array, low: float, high: float = 1.0) -> None:
        """Check independent trials, each a hit with a probability between low and high.

        Exact: binomial tails of RATE together.
        """
        from scipy.stats import binom  # late, here and below: most runs claim nothing

        count, hit = len(hits), int(np.sum(hits))
        self.spent += RATE
        self.seen.append((hit, count, low, high))
        sides = (low > 0) + (high < 1)
        least = binom.ppf(RATE / sides, count, low) if low > 0 else 0
        most = binom.isf(RATE / sides, count, high) if high < 1 else count
        assert least <= hit <= most, f"{hit} of {count}, not {least:g} to {most:g}"

    def distributed(self, values: Sequence[float] | Array, cdf: object) -> None:
        """Independent values of a distribution: Kolmogorov and Smirnov's distance, exact."""
        from scipy.stats import kstest

        self.spent += RATE
        p = kstest(values, cdf, method="exact").pvalue
        assert p > RATE, f"p = {p:.1e}"

    def mean(self, values: Sequence[float] | Array, low: float, high: float) -> None:
        """Independent values whose mean lies between low and high.

        By the normal distribution of a mean of many, at RATE / 100, since the tails of a mean of
        some hundred are heavier than normal.
        """
        from scipy.stats import norm

        self.spent += RATE
        off = norm.isf(RATE / 200) * np.std(values, ddof=1) / sqrt(len(values))
        middle = float(np.mean(values))
        assert low - off <= middle <= high + off, f"{middle:.3g}, {low:g} to {high:g} by {off:.2g}"

    def scatter(self, values: Sequence[float] | Array, sigma: float) -> None:
        """Independent normal values of an unknown mean and this standard deviation: chi2, exact."""
        from scipy.stats import chi2

        self.spent += RATE
        freedom = len(values) - 1
        ratio = float(np.var(values, ddof=1) / sigma**2)
        low, high = chi2.ppf([RATE / 2, 1 - RATE / 2], freedom) / freedom
        assert low <= ratio <= high, f"variance {ratio:.3g} of what it should be"

    def normal(self, values: Sequence[float] | Array) -> None:
        """Standard normal values, independent or not, none of them too large."""
        from scipy.stats import norm

        self.spent += RATE
        largest = float(np.max(np.abs(values)))
        assert largest <= norm.isf(RATE / 2 / len(values)), f"{largest:.2f} standard deviations"

    def zero_on_average(self, terms: Array, largest: float, variance: float) -> None:
        """Sum of independent terms of mean 0, none beyond ``largest``, variances summing to
        ``variance``: Bernstein's inequality."""
        self.spent += RATE
        t = log(2 / RATE)
        bound = largest * t / 3 + sqrt((largest * t / 3) ** 2 + 2 * variance * t)
        assert abs(np.sum(terms)) <= bound, f"{np.sum(terms):.3g}, bound {bound:.3g}"


def stated(words: str | None) -> float:
    """The false-failure rate that a docstring states; 0 where it states none."""
    match = STATED.search(words or "")
    return float(match[1]) if match else 0.0


def budget() -> dict[str, float]:
    """Every test that claims, with the rate that it states."""
    rates = {}
    for path in sorted(Path(__file__).parent.rglob("test_*.py")):
        text = path.read_text()
        for node in ast.walk(ast.parse(text)) if "chance" in text else ():
            if not isinstance(node, ast.FunctionDef) or not node.name.startswith("test_"):
                continue
            if any(argument.arg == "chance" for argument in node.args.args):
                name = f"{path.relative_to(Path(__file__).parent)}::{node.name}"
                rates[name] = stated(ast.get_docstring(node))
                assert not any("parametrize" in ast.dump(d) for d in node.decorator_list), name
    return rates


if __name__ == "__main__":
    rates = budget()
    for name, rate in rates.items():
        print(f"{rate:.1e}  {name}")
    print(f"{sum(rates.values()):.1e}  all {len(rates)}, at most {LIMIT:g}")
