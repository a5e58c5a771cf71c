"""A benchmark for methods that find what a tyre model lacks: trials, a baseline, and the score.

It needs Python and NumPy, and nothing of tyrecal:

    python benchmark.py unpack DIR                     # trials, signatures and model: CSV and JSON
    python benchmark.py baseline DIR baseline.csv      # answers of the nearest signature
    python benchmark.py tyrecal tyrecal.csv            # answers of tyrecal, from before the truth
    python benchmark.py score baseline.csv tyrecal.csv # one table for all entries

BENCHMARK.md describes the files. An entry is a CSV of trial, explanation, probability.
"""

from __future__ import annotations

import csv
import json
import lzma
import re
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import pairwise
from math import comb, log
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
GROUPS = "blind_study_2", "blind_study_2_second_maker"  # of trials: two makers of the data
NONE, OUTSIDE = "none", "outside"
NAMED = 0.7  # probability from which an explanation counts as named
BANDS = (0.0, 4.0, 10.0, 25.0)  # of min(lambda, distance from the nearest other effect)
FIGURES = (
    *("effect, all", *(f"effect, from {low:g}" for low in BANDS), "named, right"),
    *("none, right", "none, named an effect", "outside, right", "outside, named an effect"),
)
SPREAD = 0.5  # standard deviation of ln of a variable before the test
SIZES = 41  # of an effect, between the given ones
Row = Mapping[str, str]
# marks in the text of packed files: a file, a number in full precision, places of a decimal number
FILE, NEW, PLACES = "\x03", "\x01", "\x10"
DECIMAL = re.compile("[\x11-\x1f]")
MARK = re.compile("\x01|\x02([0-9]+);|[\x11-\x1f]")  # \x02: a number that was there, so many back


@cache
def packed(kind: str) -> tuple[dict[str, tuple[str, int, int]], np.ndarray, np.ndarray]:
    """Files of a kind as `tests/blind/archive.py` packs them: by path the text with marks for its
    numbers, and how many numbers of both kinds are before it; then these numbers."""
    content = lzma.decompress((HERE / f"{kind}.xz").read_bytes())
    head, _, content = content.partition(b"\n")
    ends = np.cumsum([0, *(int(size) for size in head.split())])
    text, *planes = (content[a:b] for a, b in pairwise(ends))
    bytes_ = [np.frombuffer(each, np.uint8).reshape(8, -1).T.tobytes() for each in planes]
    files, i, j = {}, 0, 0
    for part in text.decode().split(FILE)[1:]:
        path, _, body = part.partition("\n")
        files[path] = body, i, j
        i += body.count(NEW)
        j += len(DECIMAL.findall(body))
    return files, np.frombuffer(bytes_[0], ">f8"), np.frombuffer(bytes_[1], ">i8")


def archive(kind: str, start: str = "") -> Iterator[tuple[str, str]]:
    """Path and text of each packed file."""
    files, doubles, decimals = packed(kind)
    for path, (body, i, j) in files.items():
        if path.startswith(start):
            yield path, unpacked(body, doubles, decimals, i, j)


def unpacked(body: str, doubles: np.ndarray, decimals: np.ndarray, i: int, j: int) -> str:
    """The text with its numbers, of which its first ones are ``doubles[i]`` and ``decimals[j]``."""

    def number(mark: re.Match[str]) -> str:
        nonlocal i, j
        if mark[1]:
            return repr(float(doubles[i - int(mark[1])]))
        if mark[0] == NEW:
            i += 1
            return repr(float(doubles[i - 1]))
        value, places = int(decimals[j]), ord(mark[0]) - ord(PLACES)
        j += 1
        digits = str(abs(value)).rjust(places + 1, "0")
        return f"{'-' * (value < 0)}{digits[:-places]}.{digits[-places:]}"

    return MARK.sub(number, body)


def read(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write(path: Path, head: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Write a CSV."""
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])


def unpack(folder: Path) -> None:
    """Write what an entrant is given."""
    names = tuple(f"{group}/" for group in GROUPS)
    for path, text in archive("trials"):
        if path.startswith(names) and ("/trials/" in path or path.endswith("protocol.json")):
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8")
    marks = json.loads((HERE / "seals.json").read_text(encoding="utf-8"))
    (name,) = {marks[group]["ruler"] for group in GROUPS}
    ruler = json.loads(dict(archive("rulers"))[name])
    variables = [f"d_variable_{k}" for k in range(1, 1 + len(ruler["x0"]))]
    constants = [f"d_constant_{k}" for k in range(1, 1 + len(ruler["constants"][0]))]
    numbers = zip(ruler["rows"], ruler["eta"], ruler["jacobian"], ruler["constants"], strict=True)
    model = [[*row, eta, *J, *g] for row, eta, J, g in numbers]
    write(folder / "model.csv", ["mode", "pressure_kPa", "ln_value", *variables, *constants], model)
    shifts = [
        [id, size, *row, shift, split]
        for id, each in ruler["signatures"].items()
        for size, *both in zip(each["sizes"], each["shift"], each["split"], strict=True)
        for row, shift, split in zip(ruler["rows"], *both, strict=True)
    ]
    head = ["effect", "size", "mode", "pressure_kPa", "shift", "split"]
    write(folder / "signatures.csv", head, shifts)


def observed(trial: Path) -> dict[tuple[str, float], tuple[float, float]]:
    """Mean of ln f over the members of a pair and its standard deviation, by mode and pressure."""
    values = defaultdict(list)
    for row in read(trial):
        kind = f" {row['kind']}" if row["kind"] else ""
        is_mass = row["quantity"] == "mass_kg"
        mode = "mass" if is_mass else f"[{row['c']},{row['m']}]{kind}"
        value, sigma = float(row["value"]), float(row["sigma"])
        pressure = 0.0 if is_mass else float(row["pressure_kPa"])
        values[mode, pressure].append((log(value), sigma / value))
    return {
        key: (
            float(np.mean([y for y, _ in each])),
            float(np.sqrt(sum(s**2 for _, s in each))) / len(each),
        )
        for key, each in values.items()
    }


def baseline(folder: Path) -> list[tuple[str, str, float]]:
    """Nearest signature: after a fit of the variables alone, the effect whose shift leaves the
    least chi2, with the variables fitted again; "none" below twice what scatter leaves. It states a
    probability of 1."""
    model, by_effect = read(folder / "model.csv"), defaultdict(lambda: defaultdict(dict))
    keys = [(row["mode"], float(row["pressure_kPa"])) for row in model]
    eta = np.array([float(row["ln_value"]) for row in model])
    J = np.array(
        [[float(v) for k, v in row.items() if k.startswith("d_variable")] for row in model]
    )
    for row in read(folder / "signatures.csv"):
        key = row["mode"], float(row["pressure_kPa"])
        by_effect[row["effect"]][float(row["size"])][key] = float(row["shift"])
    result = []
    for trial in sorted(folder.glob("*/trials/*.csv")):
        seen = observed(trial)
        at = [i for i, key in enumerate(keys) if key in seen]
        r = np.array([seen[keys[i]][0] for i in at]) - eta[at]
        weight = np.array([seen[keys[i]][1] for i in at]) ** -2.0
        Jw = J[at].T * weight
        P = np.diag(weight) - Jw.T @ np.linalg.solve(
            Jw @ J[at] + np.eye(J.shape[1]) / SPREAD**2, Jw
        )
        chi2 = {NONE: r @ P @ r}
        for id, sizes in by_effect.items():
            known = sorted(sizes)
            table = np.array([[sizes[e][keys[i]] for i in at] for e in known])
            fine = np.linspace(known[0], known[-1], SIZES)
            off = r - np.array([np.interp(fine, known, column) for column in table.T]).T
            chi2[id] = np.einsum("qn,nm,qm->q", off, P, off).min()
        none = chi2[NONE] < 4 * max(1, len(at) - J.shape[1])
        result.append((trial.stem, NONE if none else min(chi2, key=lambda id: chi2[id]), 1.0))
    return result


def recorded() -> list[tuple[str, str, float]]:
    """Probabilities of the diagnosis of tyrecal, hashed before the truth was opened."""
    return [
        (Path(path).stem, explanation, p)
        for group in GROUPS
        for path, text in archive("answers", f"{group}/answers/")
        for explanation, p in json.loads(text)["diagnosis"]["probabilities"].items()
        if p >= 1e-4
    ]


def score(entry: Path, truth: Sequence[Row]) -> dict[str, tuple[float, int]]:
    """Figures of an entry, each with its count: right by band of lambda (the likeliest explanation
    is the true effect or one of its group), wrongly named, recognised, Brier score."""
    stated: dict[str, dict[str, float]] = defaultdict(dict)
    for row in read(entry):
        stated[row["trial"]][row["explanation"]] = float(row["probability"])
    hits, brier = defaultdict(list), []
    for row in truth:
        p = stated.get(row["trial"], {})
        top = max(p, key=lambda key: p[key], default="")
        sure = bool(top) and p[top] >= NAMED
        accuses = sure and top not in (NONE, OUTSIDE)
        key = row["effect"] if row["kind"] == "effect" else row["kind"]
        brier.append(sum((q - (k == key)) ** 2 for k, q in {key: 0.0, **p}.items()))
        right = top in row["group"].split()
        if accuses:
            hits["named, right"].append(right and row["kind"] == "effect")
        if row["kind"] == "effect":
            low = max(band for band in BANDS if band <= float(row["band"]))
            hits[f"effect, from {low:g}"].append(right)
            hits["effect, all"].append(right)
        else:
            hits[f"{row['kind']}, right"].append(top == row["kind"])
            hits[f"{row['kind']}, named an effect"].append(accuses)
    figures = {name: (float(sum(hits[name])), len(hits[name])) for name in FIGURES}
    return {**figures, "Brier score": (float(np.sum(brier)), len(brier))}


def bounds(right: int, count: int) -> tuple[float, float]:
    """Exact 95 % interval of a share (Clopper and Pearson 1934), by bisection."""

    def solve(tail: range, rising: bool) -> float:
        low, high = 0.0, 1.0
        for _ in range(50):
            p = (low + high) / 2
            mass = sum(comb(count, k) * p**k * (1 - p) ** (count - k) for k in tail)
            low, high = (p, high) if (mass < 0.025) == rising else (low, p)
        return low

    lower = solve(range(right, count + 1), True) if right else 0.0
    return lower, solve(range(right + 1), False) if right < count else 1.0


def table(entries: Sequence[Path]) -> str:
    """All entries next to each other, as Markdown."""
    scores = {path.stem: score(path, read(HERE / "truth.csv")) for path in entries}
    lines = [f"| figure | {' | '.join(scores)} |", "|---" * (1 + len(scores)) + "|"]
    for name in (*FIGURES, "Brier score"):
        cells = []
        for each in scores.values():
            total, count = each[name]
            if name == "Brier score":
                cells.append(f"{total / count:.3f} ({count})")
            elif count:
                low, high = bounds(int(total), count)
                cells.append(f"{total:.0f} of {count}, {low:.0%} to {high:.0%}")
            else:
                cells.append("none")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main(what: str = "", *paths: str) -> None:
    head = ["trial", "explanation", "probability"]
    if what == "unpack":
        unpack(Path(paths[0]))
    elif what == "baseline":
        write(Path(paths[1]), head, baseline(Path(paths[0])))
    elif what == "tyrecal":
        write(Path(paths[0]), head, recorded())
    elif what == "score":
        print(table([Path(path) for path in paths]))
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main(*sys.argv[1:])
