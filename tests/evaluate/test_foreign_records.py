"""Records that are whole, but not ours, or not of this question: set aside, and computed again."""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.cli.main import main
from tyrecal.simulate.evaluate.evaluator import Counts
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.store import Store

from .stand_in import StandIn, ask, evaluator
from .test_store import records, same

Content = dict[str, Any]


def rewritten(path: Path, line: bytes, stored: bytes | None = None) -> None:
    """A record with another first line or other arrays, its checksum right."""
    _, _, old = path.read_bytes()[65:].partition(b"\n")
    body = line + b"\n" + (old if stored is None else stored)
    path.write_bytes(sha256(body).hexdigest().encode() + b"\n" + body)


def edited(edit: Callable[[Content], Any]) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        told = json.loads(path.read_bytes()[65:].partition(b"\n")[0])
        told = edit(told) or told
        rewritten(path, json.dumps(told).encode())

    return apply


def mode(told: Content) -> Content:
    first: Content = told["content"]["answer"]["modes"][0]
    return first


def arrays(stored: bytes) -> Callable[[Path], None]:
    return lambda path: rewritten(path, path.read_bytes()[65:].partition(b"\n")[0], stored)


def zipped(member: bytes, method: int = zipfile.ZIP_STORED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for i in range(6):
            archive.writestr(f"arr_{i}.npy", member)
    return buffer.getvalue()


def header(count: int) -> bytes:
    """Of an array that says it holds ``count`` numbers."""
    buffer = io.BytesIO()
    told = {"descr": "<f8", "fortran_order": False, "shape": (count,)}
    np.lib.format.write_array_header_1_0(buffer, told)
    return buffer.getvalue()


class Evil:
    """Unpickled, it would make a file."""

    def __reduce__(self) -> Any:
        return os.system, ("touch unpickled",)


def objects() -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, np.array([Evil()], dtype=object))
    return buffer.getvalue()


def special(make: Callable[[Path], Any]) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        path.unlink()
        make(path)

    return apply


KINDS: dict[str, Callable[[Path], None]] = {
    "no JSON": lambda path: rewritten(path, b"{nope"),
    "not text": lambda path: rewritten(path, b"\xff\xfe{}"),
    "a list": edited(lambda told: [1, 2]),
    "no keys": edited(lambda told: {"a": 1}),
    "nested too deep": lambda path: rewritten(path, b"[" * 100_000),
    "thousands of digits": lambda path: rewritten(path, b'{"content": ' + b"9" * 5000 + b"}"),
    "about a list": edited(lambda told: {**told, "about": [1]}),
    "about nothing": edited(lambda told: {**told, "about": {}}),
    "no arrays": arrays(b""),
    "no archive": arrays(b"PK\x03\x04 rubbish"),
    "a bomb": arrays(zipped(bytes(1_000_000), zipfile.ZIP_DEFLATED)),
    "a huge shape": arrays(zipped(header(10**15))),
    "too short": arrays(zipped(header(100) + bytes(80))),
    "pickled": arrays(objects()),
    "no content": edited(lambda told: {**told, "content": None}),
    "content is text": edited(lambda told: {**told, "content": "x"}),
    "an empty answer": edited(lambda told: {**told, "content": {"answer": {}}}),
    "the answer is a list": edited(lambda told: {**told, "content": {"answer": []}}),
    "a frequency of NaN": edited(lambda told: mode(told).update(frequency_Hz=float("nan"))),
    "a frequency in words": edited(lambda told: mode(told).update(frequency_Hz="31")),
    "no frequency": edited(lambda told: mode(told).update(frequency_Hz=0.0)),
    "three of a pair": edited(lambda told: mode(told).update(members=[1.0, 2.0, 3.0])),
    "no shape": edited(lambda told: mode(told).pop("amplitude")),
    "a mass of NaN": edited(lambda told: told["content"]["answer"].update(mass_kg=float("nan"))),
    "slopes of none": edited(lambda told: told["content"]["answer"].update(gradients={"A": []})),
    "another pressure": edited(lambda told: told["content"]["answer"].update(pressure_Pa=150e3)),
    "a failure without words": edited(lambda told: {**told, "content": {"cause": "unstable"}}),
    "a failure of numbers": edited(
        lambda told: {**told, "content": {"cause": 3, "words": 4, "folder": 5}}
    ),
    "another key": edited(lambda told: {**told, "key": "ab" * 32}),
    "no key": edited(lambda told: {"about": told["about"], "content": told["content"]}),
    "a pipe": special(os.mkfifo),
    "a link": special(lambda path: path.symlink_to("/dev/zero")),
    "a folder": special(Path.mkdir),
}


@pytest.mark.parametrize("kind", KINDS)
def test_is_computed_again(
    kind: str, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    fresh = ask(evaluator(tmp_path))
    (path,) = records(tmp_path)
    KINDS[kind](path)
    if kind != "another pressure":  # only who asks knows which one was wanted
        verified = Store(tmp_path / "record")
        assert verified.summary(verify=True)["damaged"] == 1 and not records(tmp_path)
        path.with_suffix(".damaged").rename(path)
        caplog.clear()
    again = evaluator(tmp_path)
    same(fresh, ask(again))
    assert again.counts == Counts(1, 0)
    assert [str(path) in r.getMessage() for r in caplog.records] == [True]  # said once
    same(fresh, ask(evaluator(tmp_path)))
    assert not (tmp_path / "unpickled").exists()


def test_two_records_that_changed_places(tmp_path: Path) -> None:
    fresh = [ask(evaluator(tmp_path), value) for value in (1e6, 2e6)]
    first, second = records(tmp_path)
    one, other = first.read_bytes(), second.read_bytes()
    first.write_bytes(other)
    second.write_bytes(one)
    again = evaluator(tmp_path)
    for before, value in zip(fresh, (1e6, 2e6), strict=True):
        same(before, ask(again, value))
    assert again.counts == Counts(2, 0)


def test_a_failures_words_and_folder_are_not_believed(tmp_path: Path) -> None:
    with pytest.raises(EvaluationFailed):
        ask(evaluator(tmp_path, StandIn("unstable")))
    (path,) = records(tmp_path)
    words, elsewhere = "\x1b]0;title\x07\x1b[31mred", str(tmp_path / "elsewhere")
    edited(lambda told: told["content"].update(words=words, folder=elsewhere))(path)
    with pytest.raises(EvaluationFailed) as failure:
        ask(evaluator(tmp_path, StandIn("unstable")))
    kept = failure.value.folder
    assert kept and kept.parent == tmp_path / "runs" and str(failure.value).isprintable()
    assert "title" in failure.value.words


def test_no_link_in_a_store_is_followed(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    ask(evaluator(tmp_path))
    (path,) = records(tmp_path)
    elsewhere = tmp_path / "elsewhere"
    path.parent.rename(elsewhere)
    path.parent.symlink_to(elsewhere)
    before = {each: each.read_bytes() for each in elsewhere.iterdir()}
    KINDS["no JSON"](path)
    before[elsewhere / path.name] = path.read_bytes()
    store = Store(tmp_path / "record")
    assert ask(evaluator(tmp_path)).modes and store.prune(0) == 0
    assert store.summary(verify=True)["records"] == 0
    assert {each: each.read_bytes() for each in elsewhere.iterdir()} == before
    assert "is a link" in caplog.text and "not recorded" in caplog.text


@pytest.mark.skipif(os.name != "posix", reason="permissions are others elsewhere")
def test_a_store_that_all_may_write_is_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    Store(tmp_path)
    assert not caplog.records
    tmp_path.chmod(0o777)
    Store(tmp_path)
    assert [str(tmp_path) in each.getMessage() for each in caplog.records] == [True]


def test_store_verify_names_what_it_sets_aside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ask(evaluator(tmp_path))
    (path,) = records(tmp_path)
    path.rename(path.with_name("00" * 32 + ".record"))
    with pytest.raises(SystemExit) as leave:
        main(["store", str(tmp_path), "--verify"])
    assert leave.value.code == 0 and "damaged: 1" in capsys.readouterr().out
