"""The blind trials on record, packed: what they were, their truth, what was answered.

    python -m tests.blind.archive pack DIR       # add the groups DIR/NAME, truth in DIR-truth/NAME
    python -m tests.blind.archive unpack DIR     # all groups
    python -m tests.blind.archive truth FILE.csv # truth of the benchmark, with its difficulty

In tests/benchmarks/blind, by the group's name, all groups of a kind in one file: trials.xz
(measured values, case, rules), truth.xz (to the last byte, so that the seal holds), rulers.xz (each
once, by the hash of the whole one, to `RULER_PLACES`) and answers.xz (what the scorers read of each
answer, to `PLACES_OF` and `SIZE_DIGITS`). seals.json has three hashes of each group: its truth, its
whole answers as they were hashed before the truth was opened, and its answers as packed; and its
ruler's name.

Each file is the texts with a mark for each number, then the numbers, their first bytes first, which
take half of what their digits take (`benchmark.archive` reads it).
"""

from __future__ import annotations

import csv
import json
import lzma
import re
import sys
from collections.abc import Mapping
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Decimal
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tyrecal.studies.blind.protocol import ANSWERS, SEAL, TRUTH, seal_answers
from tyrecal.studies.blind.ruler import RULER_FILE
from tyrecal.studies.blind.score import score

from ..benchmarks.blind.benchmark import FILE, NEW, PLACES, archive, packed

ARCHIVE = Path(__file__).parents[1] / "benchmarks" / "blind"
SEALS = ARCHIVE / "seals.json"
STUDIES = ("blind_study_1", "blind_study_2", "blind_study_2_second_maker")  # the others: study 3
RULER_PLACES = 7  # decimals of a change of ln f
PLACES_OF = {"probabilities": 6, "held_out": 4}  # decimals; Hz
SIZE_DIGITS = 6  # significant ones of an effect's size and its interval
# of rulers that do not state them
EARLIER_LAWS = {"material_laws": 0.0, "laws_shared": False, "laws_length": 0.5}
READ_OF_DIAGNOSIS = "verdict", "effect", "exchanged_labels"  # by the scorers
READ_OF_STUDIES = "likeliest", "candidate_set", "fit_p_value"  # and by those of studies 1 and 2
KINDS = "trials", "answers", "rulers", "truth"
NUMBER = re.compile(r"-?\d+\.\d+")
MOST_DIGITS = 15  # of a decimal number; others are packed in full precision
TEXT = {"id": lzma.FILTER_LZMA2, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": 1 << 26}
BYTES = {**TEXT, "lc": 0, "lp": 0, "pb": 0}


def seals() -> dict[str, dict[str, Any]]:
    """The marks of every recorded group by its name."""
    content: dict[str, dict[str, Any]] = json.loads(SEALS.read_text(encoding="utf-8"))
    return content


def unpack(name: str, folder: Path, sealed: Path | None = None) -> None:
    """Write the group as it was after it was answered to ``folder``, its truth to ``sealed``, by
    default ``folder`` with -truth behind its name."""
    mark = seals()[name]
    for kind in ("trials", "answers"):
        for path, content in archive(kind, f"{name}/"):
            _write(folder / path.removeprefix(f"{name}/"), content)
    ((_, ruler),) = archive("rulers", mark["ruler"])
    _write(folder / RULER_FILE, json.dumps(EARLIER_LAWS | json.loads(ruler)))
    _write(folder / SEAL, json.dumps({"sha256": mark["truth"]}))
    if "packed_answers" in mark:
        count = len(list((folder / "answers").glob("*.json")))
        stated = {"sha256": mark["packed_answers"], "count": count}
        _write(folder / ANSWERS, json.dumps(stated))
    truth = sealed or folder.with_name(f"{folder.name}-truth")
    ((_, content),) = archive("truth", f"{name}/{TRUTH}")
    _write(truth / TRUTH, content)


def pack(groups: Mapping[str, tuple[Path, Path]]) -> None:
    """Add groups, by name the folders of their trials and of their truth, to the record."""
    known = seals() if SEALS.exists() else {}
    files = {kind: dict(archive(kind)) if known else {} for kind in KINDS}
    for name, (folder, truth) in sorted(groups.items()):
        ruler = (folder / RULER_FILE).read_bytes()
        key = f"{sha256(ruler).hexdigest()[:16]}.json"
        files["rulers"][key] = json.dumps(shortened(json.loads(ruler), RULER_PLACES))
        files["truth"][f"{name}/{TRUTH}"] = (truth / TRUTH).read_text(encoding="utf-8")
        for path in sorted(each for each in folder.rglob("*") if each.is_file()):
            place = path.relative_to(folder).as_posix()
            if place.startswith("answers/"):
                read = read_by_scorers(json.loads(path.read_text()), name in STUDIES)
                path.write_text(content := without_exponents(json.dumps(read)), encoding="utf-8")
                files["answers"][f"{name}/{place}"] = content
            elif place not in (RULER_FILE, SEAL, ANSWERS):
                files["trials"][f"{name}/{place}"] = path.read_text(encoding="utf-8")
        known[name] = {"truth": json.loads((folder / SEAL).read_text())["sha256"], "ruler": key}
        if (folder / ANSWERS).exists():
            known[name]["answers"] = json.loads((folder / ANSWERS).read_text())["sha256"]
            known[name]["packed_answers"] = seal_answers(folder)
    ARCHIVE.mkdir(exist_ok=True)
    for kind in KINDS:
        (ARCHIVE / f"{kind}.xz").write_bytes(packed_bytes(files[kind]))
    lines = (f" {json.dumps(name)}: {json.dumps(mark)}" for name, mark in sorted(known.items()))
    SEALS.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    packed.cache_clear()


def truth_rows() -> list[list[object]]:
    """Rows that the score of `benchmarks/blind/benchmark.py` reads: of each trial its
    kind, effect, size, lambda, band (`Scored`), and the answers that count as right."""
    rows: list[list[object]] = []
    with TemporaryDirectory() as made:
        for name in STUDIES[1:]:
            unpack(name, folder := Path(made) / name)
            for each in score(folder, folder.with_name(f"{name}-truth")):
                numbers = (float(f"{x:.4g}") for x in (each.size, each.lam, min(each.band, 1e9)))
                rows.append([each.id, each.kind, each.law, *numbers, " ".join(each.group)])
    return rows


def read_by_scorers(answer: Mapping[str, Any], of_studies: bool) -> dict[str, Any]:
    """The part of an answer that the scorers read: an interval is that of a named effect, widened
    to its last digit, because some true sizes are ends of ranges, as intervals' ends are."""
    whole, out = answer["diagnosis"], answer["held_out"]
    keys = (*READ_OF_DIAGNOSIS, *(READ_OF_STUDIES if of_studies else ()))
    part = shortened({key: whole[key] for key in keys if key in whole}, PLACES_OF["held_out"])
    if whole.get("robust"):
        part["robust"] = {"robust": whole["robust"]["robust"]}
    stated = shortened(whole["probabilities"], PLACES_OF["probabilities"])
    part["probabilities"] = {key: p for key, p in sorted(stated.items()) if p}
    kept = ["value", *(["low", "high"] if whole["effect"] else [])]
    size = lambda of: of and {key: digits(of[key], key) for key in kept if key in of}
    if of_studies and "parameter" in whole:
        part["parameter"] = size(whole["parameter"])
    if "parameters" in whole:
        part["parameters"] = {id: size(of) for id, of in (whole["parameters"] or {}).items()}
    if "expected_Hz" in out:
        limits = {name: [None, *each[1:]] for name, each in out["expected_Hz"].items()}
        out = {**out, "expected_Hz": limits}
    further = {key: answer[key] for key in ("further",) if key in answer}
    read = ("plain_Hz", "with_effect_Hz", "expected_Hz")
    out = shortened({key: out[key] for key in read if key in out}, PLACES_OF["held_out"])
    return {"diagnosis": part, "held_out": out, **further}


def digits(value: float, end: str) -> float:
    """A size to `SIZE_DIGITS`; "low" and "high" ends of an interval outwards."""
    if not value:
        return value
    unit = Decimal(10) ** (Decimal(value).adjusted() + 1 - SIZE_DIGITS)
    way = {"low": ROUND_FLOOR, "high": ROUND_CEILING}.get(end, ROUND_HALF_EVEN)
    return float(Decimal(repr(value)).quantize(unit, way))


def shortened(content: Any, places: int) -> Any:
    """Plain data with its numbers to so many decimals, the sizes of effects whole."""
    if isinstance(content, float):
        return round(content, places) + 0.0  # 0.0 for -0.0
    if isinstance(content, dict):
        part = lambda key, value: value if key == "sizes" else shortened(value, places)
        return {key: part(key, value) for key, value in content.items()}
    return [shortened(v, places) for v in content] if isinstance(content, list) else content


def without_exponents(text: str) -> str:
    """JSON with its small numbers as decimals, which take less room next to each other."""
    return re.sub(r"\d(\.\d+)?e-\d+", lambda number: format(Decimal(number[0]), "f"), text)


def packed_bytes(files: Mapping[str, str]) -> bytes:
    """Files by path as `benchmark.archive` reads them."""
    doubles: dict[str, int] = {}
    decimals: list[int] = []

    def mark(number: re.Match[str]) -> str:
        token = number[0]
        whole, _, after = token.partition(".")
        value = int(whole + after)
        if len(token) <= MOST_DIGITS:
            digits = str(abs(value)).rjust(len(after) + 1, "0")
            if token == f"{'-' * (value < 0)}{digits[: -len(after)]}.{after}":
                decimals.append(value)
                return chr(ord(PLACES) + len(after))
        elif repr(float(token)) == token:
            if token in doubles:
                return f"\x02{len(doubles) - doubles[token]};"
            doubles[token] = len(doubles)
            return NEW
        return token

    texts = (f"{FILE}{path}\n{NUMBER.sub(mark, text)}" for path, text in sorted(files.items()))
    parts = ["".join(texts).encode()]
    for numbers in (np.array([*map(float, doubles)], ">f8"), np.array(decimals, ">i8")):
        parts.append(numbers.view(np.uint8).reshape(-1, 8).T.tobytes())
    head = " ".join(str(len(part)) for part in parts) + "\n"
    streams = [(head.encode() + parts[0], TEXT), *((part, BYTES) for part in parts[1:])]
    return b"".join(lzma.compress(part, filters=[options]) for part, options in streams)


def _write(path: Path, content: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content, encoding="utf-8", newline="")


def main(what: str, place: str) -> None:
    top = Path(place)
    sealed = top.with_name(f"{top.name}-truth")
    if what == "unpack":
        for name in seals():
            unpack(name, top / name, sealed / name)
    elif what == "pack":
        pack({each.name: (each, sealed / each.name) for each in top.iterdir() if each.is_dir()})
    elif what == "truth":
        with Path(place).open("w", encoding="utf-8", newline="") as file:
            head = ["trial", "kind", "effect", "size", "lambda", "band", "group"]
            csv.writer(file, lineterminator="\n").writerows([head, *truth_rows()])
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main(*sys.argv[1:3])
