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
from tyrecal.simulate.evaluate.record import MAX_ARRAYS, MAX_JSON_BYTES, Damaged, _arrays
from tyrecal.simulate.evaluate.recorded import check
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
        record = json.loads(path.read_bytes()[65:].partition(b"\n")[0])
        record = edit(record) or record
        rewritten(path, json.dumps(record).encode())

    return apply


def mode(record: Content) -> Content:
    first: Content = record["content"]["answer"]["modes"][0]
    return first


def arrays(stored: bytes) -> Callable[[Path], None]:
    return lambda path: rewritten(path, path.read_bytes()[65:].partition(b"\n")[0], stored)


def zipped(member: bytes, method: int = zipfile.ZIP_STORED, members: int = 6) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for i in range(members):
            archive.writestr(f"arr_{i}.npy", member)
    return buffer.getvalue()


def header(count: int) -> bytes:
    """Header of an array that claims to hold ``count`` numbers."""
    buffer = io.BytesIO()
    fields = {"descr": "<f8", "fortran_order": False, "shape": (count,)}
    np.lib.format.write_array_header_1_0(buffer, fields)
    return buffer.getvalue()


def halved(stored: bytes) -> bytes:
    """The arrays in numbers of two bytes, real parts only."""
    buffer = io.BytesIO()
    with np.load(io.BytesIO(stored)) as given:
        whole = {name: given[name] for name in given}
    fewer = {k: a if a.dtype.kind in "iu" else a.real.astype(np.float16) for k, a in whole.items()}
    np.savez(buffer, **fewer)
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
    "a list": edited(lambda record: [1, 2]),
    "no keys": edited(lambda record: {"a": 1}),
    "nested too deep": lambda path: rewritten(path, b"[" * 100_000),
    "thousands of digits": lambda path: rewritten(path, b'{"content": ' + b"9" * 5000 + b"}"),
    "about a list": edited(lambda record: {**record, "about": [1]}),
    "about nothing": edited(lambda record: {**record, "about": {}}),
    "too much text": lambda path: rewritten(path, b"[" + b"[]," * (MAX_JSON_BYTES // 3) + b"[]]"),
    "too many arrays": arrays(zipped(b"", members=MAX_ARRAYS + 1)),
    "no arrays": arrays(b""),
    "no archive": arrays(b"PK\x03\x04 rubbish"),
    "a bomb": arrays(zipped(bytes(1_000_000), zipfile.ZIP_DEFLATED)),
    "a huge shape": arrays(zipped(header(10**15))),
    "too short": arrays(zipped(header(100) + bytes(80))),
    "pickled": arrays(objects()),
    "no content": edited(lambda record: {**record, "content": None}),
    "content is text": edited(lambda record: {**record, "content": "x"}),
    "an empty answer": edited(lambda record: {**record, "content": {"answer": {}}}),
    "the answer is a list": edited(lambda record: {**record, "content": {"answer": []}}),
    "a frequency of NaN": edited(lambda record: mode(record).update(frequency_Hz=float("nan"))),
    "a frequency in words": edited(lambda record: mode(record).update(frequency_Hz="31")),
    "no frequency": edited(lambda record: mode(record).update(frequency_Hz=0.0)),
    "three of a pair": edited(lambda record: mode(record).update(members=[1.0, 2.0, 3.0])),
    "no shape": edited(lambda record: mode(record).pop("amplitude")),
    "a mass of NaN": edited(
        lambda record: record["content"]["answer"].update(mass_kg=float("nan"))
    ),
    "slopes of none": edited(
        lambda record: record["content"]["answer"].update(gradients={"A": []})
    ),
    "another harmonic": edited(lambda record: mode(record).update(n=99)),
    "a billion waves": edited(lambda record: mode(record).update(n=10**9)),
    "three modes of a harmonic": edited(
        lambda record: record["content"]["answer"].update(modes=3 * [mode(record)], gradients={})
    ),
    "half precision": lambda path: arrays(halved(path.read_bytes()[65:].partition(b"\n")[2]))(path),
    "another pressure": edited(
        lambda record: record["content"]["answer"].update(pressure_Pa=150e3)
    ),
    "a failure without words": edited(lambda record: {**record, "content": {"cause": "unstable"}}),
    "a failure of numbers": edited(
        lambda record: {**record, "content": {"cause": 3, "words": 4, "folder": 5}}
    ),
    "another key": edited(lambda record: {**record, "key": "ab" * 32}),
    "no key": edited(lambda record: {"about": record["about"], "content": record["content"]}),
    "a pipe": special(os.mkfifo),
    "a link": special(lambda path: path.symlink_to("/dev/zero")),
    "a folder": special(Path.mkdir),
}


# kinds that are an answer, but not to what was asked: only who asks knows that
ONLY_ASKED = (
    "another pressure",
    "another harmonic",
    "a billion waves",
    "three modes of a harmonic",
)


@pytest.mark.parametrize("kind", KINDS)
def test_is_computed_again(
    kind: str, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    fresh = ask(evaluator(tmp_path))
    (path,) = records(tmp_path)
    KINDS[kind](path)
    if kind not in ONLY_ASKED:
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


SECTION = np.array([[0.35, -0.1], [0.36, 0.0], [0.35, 0.1]])


def of_modes() -> Content:
    """Recorded answer about two modes on three points of a section, and their slopes by A."""
    one = {"frequency_Hz": 50.0, "multiplicity": 2, "n": 1, "amplitude": np.ones((3, 3), complex)}
    two = {"frequency_Hz": 60.0, "multiplicity": 1, "displacement": np.ones((3, 3))}
    return {
        "pressure_Pa": 2.4e5,
        "mass_kg": 12.0,
        "nodes": np.arange(3),
        "points": SECTION,
        "modes": [one, two],
        "gradients": {"A": np.ones(2)},
        "displacement": np.full((3, 3), 1e-3),
    }


def of_footprints() -> Content:
    """Recorded answer about one load: a patch of a point at each of three nodes, on two rings, with
    one mode."""
    patch = {
        "load_N": 4e3,
        "road_N": 4e3,
        "rim_N": np.zeros(3),
        "deflection_m": 0.02,
        "stiffness_N_per_m": 2e5,
        "ring": np.array([0, 1, 1]),
        "node": np.arange(3),
        "along_m": np.zeros(3),
        "across_m": np.zeros(3),
        "pressure_Pa": np.ones(3),
        "area_m2": np.ones(3),
        "traction_Pa": np.zeros((3, 2)),
        "displacement": np.zeros((2, 3, 3)),
        "contact_area_m2": 0.02,
        "mode_frequency_Hz": np.array([70.0]),
        "mode_node": np.array([0, 2]),
        "mode_shape": np.zeros((1, 2, 2, 3)),
        "mode_traction_N": np.array([9.0]),
        "sliding_frequency_Hz": np.array([60.0, 65.0]),
        "sliding_shape": np.zeros((2, 2, 2, 3)),
    }
    return {
        "pressure_Pa": 2.4e5,
        "mass_kg": 12.0,
        "nodes": np.arange(3),
        "points": SECTION,
        "angles": np.zeros(2),
        "free_radius_m": 0.35,
        "footprints": [patch],
        "failure": "",
    }


MODES: list[Content] = [
    {"pressure_Pa": -1.0},
    {"pressure_Pa": True},
    {"mass_kg": 0.0},
    {"mass_kg": np.ones(1)},
    {"nodes": np.arange(3.0)},
    {"nodes": np.zeros((3, 1), int)},
    {"nodes": np.arange(2)},
    {"points": np.zeros((4, 2))},
    {"points": np.zeros((3, 4))},
    {"points": np.zeros((3, 1))},
    {"points": np.full((3, 2), np.nan)},
    {"points": np.zeros(3)},
    {"points": np.zeros((3, 2))},
    {"points": SECTION * [1, 0]},
    {"points": SECTION.astype(np.float16)},
    {"modes": ()},
    {"modes": [], "gradients": {}},
    {"displacement": np.zeros((3, 3))},
    {"displacement": np.zeros((3, 2))},
    {"displacement": np.zeros((2, 3))},
    {"displacement": np.full((3, 3), np.inf)},
    {"gradients": {"A": np.ones(3)}},
    {"gradients": {"A": np.ones((2, 1))}},
    {"gradients": {"A": np.full(2, np.nan)}},
]
MODE: list[Content] = [
    {"frequency_Hz": -1.0},
    {"frequency_Hz": np.inf},
    {"frequency_Hz": 1e308},
    {"frequency_Hz": 1e-4},
    {"multiplicity": 0},
    {"multiplicity": 1.5},
    {"multiplicity": 10**15},
    {"n": -1},
    {"n": 0.5},
    {"amplitude": np.ones((3, 2))},
    {"amplitude": np.ones((2, 3))},
    {"amplitude": np.full((3, 3), np.nan)},
    {"amplitude": "x"},
    {"members": np.ones(3)},
    {"members": np.array([50.0, 0.0])},
    {"members": np.array([50.0, 1e300])},
    {"amplitude": np.zeros((3, 3), complex)},
    {"amplitude": None},
]
PRESSED: list[Content] = [
    {"angles": np.zeros(3)},
    {"angles": np.zeros((2, 1))},
    {"free_radius_m": 0.0},
    {"footprints": []},
    {"failure": 3},
    {"cause": "timed_out"},
    {"points": np.zeros((4, 2))},
]
PATCH: list[Content] = [
    {"load_N": 0.0},
    {"road_N": np.nan},
    {"rim_N": np.zeros(2)},
    {"deflection_m": "deep"},
    {"stiffness_N_per_m": np.inf},
    {"ring": np.array([0, 1, 2])},
    {"ring": np.array([-1, 0, 1])},
    {"ring": np.array([0.0, 1.0, 1.0])},
    {"node": np.array([0, 1, 3])},
    {"ring": np.array([0, 1])},
    *({name: np.zeros(2)} for name in ("along_m", "across_m", "pressure_Pa", "area_m2")),
    {"node": np.array([0, 1])},
    {"traction_Pa": np.zeros((2, 2))},
    {"surplus": 1.0},
    {"traction_Pa": np.zeros((3, 3))},
    {"displacement": np.zeros((3, 3, 3))},
    {"displacement": np.zeros((2, 2, 3))},
    {"displacement": np.zeros((2, 3, 2))},
    {"contact_area_m2": 0.0},
    {"mode_frequency_Hz": None},
    {"mode_node": None},
    {"mode_shape": None},
    {"mode_frequency_Hz": np.ones(2)},
    {"mode_node": np.arange(3)},
    {"mode_shape": np.zeros((1, 3, 2, 3))},
    {"mode_shape": np.zeros((1, 2, 2, 2))},
    {"mode_traction_N": None},
    {"mode_traction_N": np.ones(2)},
    {"sliding_frequency_Hz": None},
    {"sliding_frequency_Hz": np.ones(1)},
    {"sliding_shape": None},
    {"sliding_shape": np.zeros((2, 2, 3, 3))},
]


@pytest.mark.parametrize(
    ("change", "where"),
    [
        (change, where)
        for where, changes in (
            ("modes", MODES),
            ("mode", MODE),
            ("pressed", PRESSED),
            ("patch", PATCH),
        )
        for change in changes
    ],
    ids=str,
)
def test_what_does_not_go_together_is_no_record(change: Content, where: str) -> None:
    content = of_modes() if where in ("modes", "mode") else of_footprints()
    check({"answer": content})
    inner = {"mode": lambda: content["modes"][0], "patch": lambda: content["footprints"][0]}
    inner.get(where, lambda: content)().update(change)
    with pytest.raises(Damaged):
        check({"answer": content})


def test_what_may_be_missing_of_a_record() -> None:
    """Slopes, the inflation, harmonics' points in three dimensions, what was not measured of a
    shape; modes under load and the area of a patch."""
    content = of_modes()
    in_3d = np.column_stack([SECTION, SECTION[:, 1]])
    content |= {"gradients": {}, "displacement": np.zeros((0, 3)), "points": in_3d}
    content["modes"][1]["displacement"][0] = np.nan
    check({"answer": content})
    flat = content["modes"].pop(0)
    content["nodes"] = np.arange(2)  # of the section alone they are the points'
    check({"answer": content})
    content["modes"].append(flat)
    with pytest.raises(Damaged):
        check({"answer": content})
    content = of_footprints()
    for name in ("mode_traction_N", "sliding_frequency_Hz", "sliding_shape"):
        del content["footprints"][0][name]
    check({"answer": content})  # of a road without friction
    for name in ("contact_area_m2", "mode_frequency_Hz", "mode_node", "mode_shape"):
        del content["footprints"][0][name]
    check({"answer": content | {"cause": "unstable", "failure": "it fell over"}})
    check({"cause": "unstable", "words": "it fell over", "folder": None})
    for cause in ("timed_out", 3):
        with pytest.raises(Damaged):
            check({"cause": cause, "words": "it fell over", "folder": None})


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
    edited(lambda record: record["content"].update(words=words, folder=elsewhere))(path)
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
    assert "is a link" in caplog.text and "not stored" in caplog.text


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


def test_arrays_that_are_packed_are_not_unpacked() -> None:
    """Packed arrays are refused, whether packing makes them smaller or not; plain ones are read."""
    noise = np.random.default_rng(0).bytes(4000)
    for array in (np.zeros(1000), np.frombuffer(noise, np.uint8)):
        plain, packed = io.BytesIO(), io.BytesIO()
        np.savez(plain, a=array)
        np.savez_compressed(packed, a=array)
        np.testing.assert_array_equal(_arrays(plain.getvalue())["a"], array)
        with pytest.raises(Damaged, match="larger than the file"):
            _arrays(packed.getvalue())
