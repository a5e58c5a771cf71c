"""Rates at which the statistical tests fail, and how far their claims are from failing.

    python tests/studies/chance.py [seeds] [first] [folder or file ...]

Every test that claims through ``tests.chance`` is run with each seed in one process. Told as a
Markdown table: runs that failed of all, and of each claim "this often" the stated bounds beside
the share that was seen over all seeds, with exact 95 % bounds.
"""

from __future__ import annotations

import contextlib
import io
import sys
from collections import Counter, defaultdict
from pathlib import Path

import pytest

from tests.chance import budget
from tyrecal.studies.blind.score import clopper_pearson

TESTS = Path(__file__).parents[1]


class Record:
    """A plugin that keeps what the tests told."""

    def __init__(self) -> None:
        self.runs: Counter[str] = Counter()
        self.failed: dict[str, list[int]] = defaultdict(list)
        self.seen: dict[tuple[str, int, float, float], list[int]] = defaultdict(lambda: [0, 0])
        self.seed = 0

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        name = report.nodeid.removeprefix("tests/")
        if report.failed:
            self.failed[name].append(self.seed)
        self.runs[name] += report.when == "call"
        if report.when == "teardown":
            for i, (hit, count, low, high) in enumerate(dict(report.user_properties)["seen"]):
                total = self.seen[name, i, low, high]
                total[0] += hit
                total[1] += count


def main(seeds: int, first: int, only: list[str]) -> int:
    names = [name for name in budget() if name.startswith(tuple(only) or "")]
    record = Record()
    for record.seed in range(first, first + seeds):
        words = ["-q", "-p", "no:cacheprovider", "--seed", str(record.seed)]
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            code = pytest.main([*words, *(str(TESTS / name) for name in names)], plugins=[record])
        if code:
            print(out.getvalue(), file=sys.stderr, flush=True)
    print(f"| test | of {seeds} runs failed | claimed | seen |\n|---|---|---|---|")
    for name in names:
        claims = [
            (low, high, *total) for (n, _, low, high), total in record.seen.items() if n == name
        ]
        bounds = [clopper_pearson(hit, count) for _, _, hit, count in claims]
        print(
            f"| {name} | {len(set(record.failed[name]))} |",
            "; ".join(f"{low:g} to {high:g}" for low, high, *_ in claims),
            "|",
            "; ".join(
                f"{hit} of {count}: {a:.4f} to {b:.4f}"
                for (_, _, hit, count), (a, b) in zip(claims, bounds, strict=True)
            ),
            "|",
        )
    failures, runs = (
        sum(len(set(each)) for each in record.failed.values()),
        sum(record.runs.values()),
    )
    print(f"\n{failures} of {runs} runs failed")
    return failures


if __name__ == "__main__":
    numbers, names = sys.argv[1:3], sys.argv[3:]
    sys.exit(bool(main(*map(int, [*numbers, *["100", "0"][len(numbers) :]]), names)))
