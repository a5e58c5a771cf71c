"""Drawn tables: slips among repeats, exchanged pressures and labels, mutated files.

    python -m tests.studies.tables --count 200 --seed 1

Three studies of ``count`` tables each. *slips*: 6 to 12 labels with 2 to 5 repeats that scatter by
0.1 to 0.5 %, written with 1 to 3 decimals; half have one value mistyped (a digit, two digits
exchanged, another label's value) that is more than 6 standard deviations from the label's other
repeats. *sense*: tyres with drawn variables at 1 to 3 pressures, 0.1 to 0.5 % noise; a third have
two pressures exchanged, a third two labels, at one pressure or at all. *mutants*: a table with
bytes, cells and lines changed. Prints counts as JSON; exit code 1 where a mutant ends in anything
but measurements or an InputError.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from time import perf_counter

import numpy as np

import tyrecal
from tyrecal.errors import InputError
from tyrecal.measured.gather import gather
from tyrecal.measured.measurement import Measurement
from tyrecal.measured.repeats import combined
from tyrecal.measured.sense import doubts
from tyrecal.measured.slips import contradictions
from tyrecal.simulate.modes.label import Label
from tyrecal.tyre.case import start_values
from tyrecal.tyre.values import set_values

CASES = Path(__file__).parents[2] / "cases"
LABELS = [Label(0, 0, "axial"), Label(0, 0, "torsional")]
LABELS += [Label(c, m) for c in (1, 2, 3, 4, 5) for m in (0, 1)]
PLAIN = (
    "run;label;pressure [bar];f [Hz];sigma [%]\n"
    "1;[2,1];2,4;66,1;0,5\n2;[2,1];2,4;66,3;0,5\n1;[3,0];2,4;97,6;0,5\n2;[3,0];2,4;97,4;n.a.\n"
)
WORDS = [
    "",
    "1.000",
    "4.000",
    "-1",
    "1e999",
    "nan",
    "\x00",
    "é",
    '"',
    "[1,1]x2",
    "\u202e",
    "9" * 400,
]
WORDS += ["[", ";", ",", "\t", "n.a.", "Hz", "79,5 Hz", "label", "\ufeff", "1.2.3", "PK\x03\x04"]
LONGEST_s, MOST_BYTES = 10.0, 1e9
Random = np.random.Generator


def repeats(random: Random, slip: bool) -> tuple[list[Measurement], list[Measurement], int]:
    """A table, the same without its slip, and the slip's place in it; -1: none."""
    n, runs, scatter = random.integers(6, 13), random.integers(2, 6), 10 ** random.uniform(-3, -2.3)
    truth = np.sort(random.uniform(30, 180, n))[:, None]
    noise = scatter * random.standard_normal((n, runs))
    clean = np.round(truth * (1 + noise), random.integers(1, 4))
    spread = float(np.sqrt(np.mean((clean / clean.mean(1, keepdims=True) - 1) ** 2)))
    spread *= np.sqrt(runs / (runs - 1))
    wrong, place = clean.copy(), -1
    while slip and place < 0:
        i, j = random.integers(n), random.integers(runs)
        text = list(f"{clean[i, j]:.6g}")
        digits = [k for k, each in enumerate(text) if each.isdigit()]
        a, b = random.choice(digits, 2, replace=False)
        kind = random.integers(3)
        if kind == 0:
            text[a] = str(random.integers(10))
        elif kind == 1:
            text[a], text[b] = text[b], text[a]
        else:
            text = list(f"{clean[(i + 1) % n, j]:.6g}")
        value = float("".join(text))
        others = np.delete(clean[i], j).mean()
        far = 6 * spread * np.sqrt(runs / (runs - 1))
        if 2 < value < 1000 and abs(value / others - 1) > far:
            wrong[i, j], place = value, int(i * runs + j)

    def rows(values: np.ndarray) -> list[Measurement]:
        return [
            Measurement(
                *("frequency_Hz", LABELS[i], "", 240.0, 0.0, float(values[i, j])),
                run=f"{j}",
                place=f"t.csv, line {2 + i * runs + j}",
            )
            for i, j in np.ndindex(values.shape)
        ]

    return rows(wrong), rows(clean), place


def slips(count: int, seed: int) -> dict[str, int]:
    """Counts of drawn tables of repeats."""
    tally = {"with_slip": 0, "reported": 0, "sigma_off_by_20_percent": 0}
    tally |= {"without": 0, "reported_without": 0}
    for k in range(count):
        random = np.random.default_rng([seed, 0, k])
        wrong, clean, place = repeats(random, slip=k % 2 == 0)
        reports = contradictions(wrong)
        if place < 0:
            tally["without"] += 1
            tally["reported_without"] += bool(reports)
            continue
        tally["with_slip"] += 1
        left_out = [each for report in reports for each in report.left_out]
        if not any(each is wrong[place] for each in left_out):
            continue
        tally["reported"] += 1
        kept = [each for each in wrong if not any(each is out for out in left_out)]
        before, after = ({r.label: r.sigma / r.value for r in combined(x)} for x in (clean, kept))
        shares = [after[x] / before[x] for x in after if x != wrong[place].label]
        tally["sigma_off_by_20_percent"] += max(abs(x - 1) for x in shares) > 0.2
    return tally


def drawn_tyres(count: int, seed: int) -> list[list[tuple[Label, float, float]]]:
    """Label, pressure and frequency of tyres at three pressures."""
    random = np.random.default_rng([seed, 1])
    tyres = []
    for k in range(count):
        case = tyrecal.load_case(
            CASES / ["p235_75r17.yaml", "205_60r15.yaml"][k % 2], mesh="coarse"
        )
        values = {
            name: value * float(np.exp(0.35 * random.standard_normal()))
            for name, value in start_values(case).items()
        }
        pressures = [share * case.case.pressure_kPa for share in (0.8, 1.0, 1.25)]
        tyres.append(
            [
                (mode.label, p, mode.frequency_Hz)
                for p in pressures
                for mode in tyrecal.evaluate_modes(set_values(case, {**values, "pressure_kPa": p}))
            ]
        )
    return tyres


def sense(count: int, seed: int, tyres: int) -> dict[str, int]:
    """Counts of drawn tests with pressures or labels exchanged."""
    known = drawn_tyres(tyres, seed)
    tally: dict[str, int] = {}
    for k in range(count):
        random = np.random.default_rng([seed, 2, k])
        tyre, kind = known[random.integers(tyres)], ("pressures", "labels", "neither")[k % 3]
        at = sorted({p for _, p, _ in tyre})
        at = sorted(random.choice(at, random.integers(2 if kind == "pressures" else 1, 4), False))
        labels = sorted({label for label, _, _ in tyre}, key=str)
        kept = [labels[i] for i in random.choice(len(labels), random.integers(6, 11), False)]
        scatter = 10 ** random.uniform(-3, -2.3)
        rows = [
            Measurement(
                *("frequency_Hz", label, "", p, 0.0, f * (1 + scatter * random.standard_normal())),
                *(scatter * f, "", f"t.csv, line {i + 2}"),
            )
            for i, (label, p, f) in enumerate(tyre)
            if p in at and label in kept
        ]
        if kind == "pressures":
            p, q = random.choice(at, 2, replace=False)
            names = {p: q, q: p}
            rows = [
                replace(r, pressure_kPa=names.get(r.pressure_kPa, r.pressure_kPa)) for r in rows
            ]
        if kind == "labels":
            a, b = (kept[i] for i in random.choice(len(kept), 2, replace=False))
            where = at if random.integers(2) else [random.choice(at)]
            swap = {a: b, b: a}
            rows = [
                replace(r, label=swap.get(r.label or a, r.label)) if r.pressure_kPa in where else r
                for r in rows
            ]
        tally[kind] = tally.get(kind, 0) + 1
        tally[f"{kind}_reported"] = tally.get(f"{kind}_reported", 0) + bool(doubts(rows))
    return tally


def mutants(count: int, seed: int) -> dict[str, int]:
    """Counts of mutated tables: read, refused, and anything else, as which a table counts, too,
    that takes more than `LONGEST_s` or brings the process to `MOST_BYTES`."""
    tally, before = {"read": 0, "refused": 0, "faults": 0}, _peak()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "t.csv"
        for k in range(count):
            random = np.random.default_rng([seed, 3, k])
            content = bytearray(PLAIN.encode())
            for _ in range(random.integers(1, 6)):
                i, kind = int(random.integers(len(content) + 1)), random.integers(4)
                if kind == 0:
                    content[i:i] = str(random.choice(WORDS)).encode()
                elif kind == 1:
                    del content[i : i + int(random.integers(1, 30))]
                elif kind == 2:
                    content[i : i + 1] = bytes([random.integers(256)])
                else:
                    content[i:i] = content[: int(random.integers(1, 60))]
            path.write_bytes(content)
            start = perf_counter()
            try:
                gather([path], 240.0, assumed=0.005, keep_going=bool(random.integers(2)))
                tally["read"] += 1
            except InputError as error:
                tally["refused"] += bool(str(error))
                tally["faults"] += not str(error)
            except Exception as error:
                tally["faults"] += 1
                print(f"mutant {k}: {type(error).__name__}: {error}", file=sys.stderr)
            tally["faults"] += perf_counter() - start > LONGEST_s
    tally["faults"] += _peak() > max(before, MOST_BYTES)
    return tally


def _peak() -> float:
    """The most memory that this process has had, bytes."""
    return 1024.0 * getrusage(RUSAGE_SELF).ru_maxrss


def main(arguments: list[str] | None = None) -> int:
    """Run the studies; see above."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tyres", type=int, default=60)
    given = parser.parse_args(arguments)
    tally = {
        "slips": slips(given.count, given.seed),
        "sense": sense(given.count, given.seed, given.tyres),
        "mutants": mutants(5 * given.count, given.seed),
    }
    print(json.dumps(tally))
    return 1 if tally["mutants"]["faults"] else 0


if __name__ == "__main__":
    sys.exit(main())
