"""The blind trials on record, packed: what they were, their truth, what was answered.

    python -m tests.blind.archive pack DIR       # add the groups DIR/NAME, truth in DIR-truth/NAME
    python -m tests.blind.archive unpack DIR     # all groups
    python -m tests.blind.archive truth FILE.csv # truth of the benchmark, with its difficulty

In tests/benchmarks/blind, by the group's name, all groups of a kind in one solid archive:
trials.tar.xz (measured values, case, rules), truth.tar.xz (to the last byte, so that the seal
holds), rulers.tar.xz (each once, by its hash) and answers.tar.xz (what the scorers read of each
answer, to `ANSWER_DIGITS`). seals.json has three hashes of each group: its truth, its whole answers
as they were hashed before the truth was opened, and its answers as packed; and its ruler's name.
"""

from __future__ import annotations

import csv
import io
import json
import lzma
import sys
import tarfile
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tyrecal.studies.blind.ruler import RULER_FILE
from tyrecal.studies.blind.score import score
from tyrecal.studies.blind.seal import ANSWERS, SEAL, TRUTH, seal_answers

ARCHIVE = Path(__file__).parents[1] / "benchmarks" / "blind"
SEALS = ARCHIVE / "seals.json"
STUDIES = ("blind_study_1", "blind_study_2", "blind_study_2_second_maker")  # the others: study 3
ANSWER_DIGITS = 7  # significant
READ_OF_DIAGNOSIS = (  # by the scorers
    *("verdict", "effect", "likeliest", "probabilities", "candidate_set", "exchanged_labels"),
    *("parameter", "parameters", "fit_p_value", "robust"),
)
READ_OF_PARAMETER = ("value", "low", "high")
FILTERS = [{"id": lzma.FILTER_LZMA2, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": 1 << 26}]


def seals() -> dict[str, dict[str, Any]]:
    """The marks of every recorded group by its name."""
    content: dict[str, dict[str, Any]] = json.loads(SEALS.read_text(encoding="utf-8"))
    return content


def unpack(name: str, folder: Path, sealed: Path | None = None) -> None:
    """Write the group as it was after it was answered to ``folder``, its truth to ``sealed``, by
    default ``folder`` with -truth behind its name."""
    mark = seals()[name]
    for path, content in (_read("trials") | _read("answers")).items():
        if path.startswith(f"{name}/"):
            place = folder / path.removeprefix(f"{name}/")
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)
    _write(folder / RULER_FILE, _read("rulers")[mark["ruler"]])
    _write(folder / SEAL, json.dumps({"sha256": mark["truth"]}).encode())
    if "packed_answers" in mark:
        count = len(list((folder / "answers").glob("*.json")))
        stated = {"sha256": mark["packed_answers"], "count": count}
        _write(folder / ANSWERS, json.dumps(stated).encode())
    truth = sealed or folder.with_name(f"{folder.name}-truth")
    _write(truth / TRUTH, _read("truth")[f"{name}/{TRUTH}"])


def pack(groups: Mapping[str, tuple[Path, Path]]) -> None:
    """Add groups, by name the folders of their trials and of their truth, to the record."""
    known = seals() if SEALS.exists() else {}
    kinds = ("trials", "answers", "rulers", "truth")
    files = {kind: dict(_read(kind)) if known else {} for kind in kinds}
    for name, (folder, truth) in sorted(groups.items()):
        ruler = (folder / RULER_FILE).read_bytes()
        key = f"{sha256(ruler).hexdigest()[:16]}.json"
        files["rulers"][key] = ruler
        files["truth"][f"{name}/{TRUTH}"] = (truth / TRUTH).read_bytes()
        for path in sorted(each for each in folder.rglob("*") if each.is_file()):
            place = path.relative_to(folder).as_posix()
            if place.startswith("answers/"):
                content = json.dumps(read_by_scorers(json.loads(path.read_text())))
                path.write_text(content, encoding="utf-8")
                files["answers"][f"{name}/{place}"] = content.encode()
            elif place not in (RULER_FILE, SEAL, ANSWERS):
                files["trials"][f"{name}/{place}"] = path.read_bytes()
        known[name] = {"truth": json.loads((folder / SEAL).read_text())["sha256"], "ruler": key}
        if (folder / ANSWERS).exists():
            known[name]["answers"] = json.loads((folder / ANSWERS).read_text())["sha256"]
            packed = sorted((folder / "answers").glob("*.json"))
            known[name]["packed_answers"] = seal_answers(folder, packed)
    ARCHIVE.mkdir(exist_ok=True)
    for kind in kinds:
        _write_archive(ARCHIVE / f"{kind}.tar.xz", files[kind])
    lines = (f" {json.dumps(name)}: {json.dumps(mark)}" for name, mark in sorted(known.items()))
    SEALS.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    _read.cache_clear()


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


def read_by_scorers(answer: Mapping[str, Any]) -> dict[str, Any]:
    """The part of an answer that the scorers read: sizes of effects whole, other numbers to
    `ANSWER_DIGITS`."""
    whole = answer["diagnosis"]
    part = {key: whole[key] for key in READ_OF_DIAGNOSIS if key in whole}
    own = lambda size: size and {key: size[key] for key in READ_OF_PARAMETER if key in size}
    if part.get("robust"):
        part["robust"] = {"robust": part["robust"]["robust"]}
    kept = {key: answer[key] for key in ("held_out", "further") if key in answer}
    read: dict[str, Any] = _shortened({"diagnosis": part, **kept})
    # whole: intervals end where the range of an effect does, as some true sizes do
    if "parameter" in part:
        read["diagnosis"]["parameter"] = own(part["parameter"])
    if part.get("parameters"):
        sizes = {id: own(size) for id, size in part["parameters"].items()}
        read["diagnosis"]["parameters"] = sizes
    return read


def _shortened(content: Any) -> Any:
    if isinstance(content, float):
        return float(f"{content:.{ANSWER_DIGITS}g}")
    if isinstance(content, dict):
        return {key: _shortened(value) for key, value in content.items()}
    return [_shortened(value) for value in content] if isinstance(content, list) else content


@cache
def _read(kind: str) -> dict[str, bytes]:
    """Every file of an archive by its path; there are at most 40 MB of them."""
    with tarfile.open(ARCHIVE / f"{kind}.tar.xz") as archive:
        members = [each for each in archive.getmembers() if each.isfile()]
        streams = [archive.extractfile(each) for each in members]
        return {m.name: s.read() for m, s in zip(members, streams, strict=True) if s}


def _write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    with (
        lzma.open(path, "wb", filters=FILTERS) as stream,
        tarfile.open(fileobj=stream, mode="w", format=tarfile.USTAR_FORMAT) as archive,
    ):
        for name, content in sorted(files.items()):
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


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
