"""Mutated inputs: whatever a stranger's files hold, one sentence, and nothing outside is changed.

    python -m tests.studies.mutated_inputs --count 1000 --seed 1 --output mutated.jsonl

``count`` inputs of each kind: records of evaluations, cases with their tables, results folders,
decks, requests to the bundled solver, universal files; or, where ``--kind`` names them, fits and
footprints of cases with one or two extreme numbers that ``validate`` lets pass. Each is drawn from
(seed, kind, number) alone, so the same command goes on where it was stopped, and ``--kind KIND
--only NUMBER`` repeats one. Wrong are: an exception that ends in a traceback, an exit code that is
not documented, one above 0 without a word, a control character on the terminal, more than 10 s of
processor time (60 of fits and footprints; or 120 s without an end) or, of a universal file, 1 GB of
memory, any file beside the mutated folder that was changed, and a result of no tyre (beyond 1 t,
below 1 Hz, not finite) without a word of warning. Exit code 1 where something was wrong.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from hashlib import sha256
from pathlib import Path
from random import Random
from typing import Any

from tyrecal_solvers.bundled.__main__ import main as solve

from tyrecal.cli.main import main as tyrecal
from tyrecal.simulate.evaluate.results import evaluation
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.label import paired_labels

from ..measured.ten_modes import files as universal_files

CASES = Path(__file__).parents[2] / "cases"
CPU_S, WALL_S = 10, 120
LONG_S = 60  # of processor time: a fit, a footprint
MEMORY = 4_000_000_000  # bytes of address space
MEASURED_kB = 1_000_000  # of memory, for a universal file
WAYS = ("plain", "a frame per node, 18", "a frame per node, 2420", "shapes, 55", "shapes, 2414")
WAYS += ("components", "hammer", "two references", "mm")
CODES = {0, 2, 3, 4, 5}
BATCH = 20  # trials of one forked process
NUMBERS = ["0", "-1", "1e300", "-1e-300", "1e999", "NaN", ".inf", "9" * 400, "1:30", "0x1F", "1_0"]
WORDS = [
    "",
    "~",
    "\x1b]0;x\x07",
    "\u202e",
    "é",
    "\x00",
    "../x",
    "/etc/passwd",
    "a" * 5000,
    "%YAML",
    "*alias",
    "&anchor",
    "!!python/object:os.system",
    "{{ 1 }}",
    "\r\n",
    "\t",
    "[" * 300,
    "*INCLUDE, INPUT=/etc/passwd",
    "null",
    "true",
    "''",
    "- ",
    ": ",
    ",",
]
VALUES: list[Any] = [
    None,
    True,
    0,
    -1,
    1e300,
    float("nan"),
    float("inf"),
    10**400,
    "",
    "x",
    "\x1b[31m",
    [],
    {},
    [[]],
    [None],
    {"a": {}},
    "9" * 3000,
    -0.0,
    1e-320,
    [1e300] * 3,
]


NUMBER = re.compile(r"(?<=[ \[])-?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?(?=[ ,\]}\n])")
WITH_MORE = (  # numbers that count, and no others
    (r" *#.*", ""),
    (r"^(name|  source): .*", r"\1: none"),
    (r"^uncertainties:(?s:.*?)^(?=\S)", ""),
    (r"(frequency_Hz: [\d.]+)}", r"\1, sigma_Hz: 0.4, weight: 1.5}"),
    (r"(vibration_frequency_Hz:) null", r"\1 60.0"),
    (
        r"\Z",
        "\nroad: {friction: 0.8, elastic_slip_m: 2.0e-4, loads_N: [2000.0, 4000.0]}"
        "\neffects: {bead_filler: 0.5, tread_density: 0.1, rim_width: 1.0e-3}\n",
    ),
)


class Slow(BaseException):
    """Error: too much processor time."""


def mutated(data: bytes, chance: Random) -> bytes:
    """Bytes changed at one place or a few: flipped, cut, doubled, swapped lines, other numbers."""
    for _ in range(chance.choice([1, 1, 1, 2, 4])):
        at = chance.randrange(len(data) + 1)
        to = min(len(data), at + chance.choice([1, 2, 8, 40, 400]))
        how = chance.randrange(8)
        if how == 0 and data:
            data = data[:at] + bytes([chance.randrange(256)]) + data[at + 1 :]
        elif how == 1:
            data = data[:at] + data[to:]
        elif how == 2:
            data = data[:to] + data[at:to] * chance.choice([1, 3, 100]) + data[to:]
        elif how == 3:
            data = data[:at]
        elif how in (4, 5):
            words = data.split(b" ")
            numbers = [i for i, word in enumerate(words) if any(c in b"0123456789" for c in word)]
            if numbers:
                words[chance.choice(numbers)] = chance.choice(NUMBERS).encode()
            data = b" ".join(words)
        elif how == 6:
            data = data[:at] + chance.choice(WORDS).encode() + data[at:]
        else:
            lines = data.split(b"\n")
            i, j = chance.randrange(len(lines)), chance.randrange(len(lines))
            lines[i], lines[j] = lines[j], lines[i]
            data = b"\n".join(lines)
    return data


def mutated_json(content: Any, chance: Random) -> Any:
    """Replace or remove one value somewhere in the file."""
    here, path = content, []
    while isinstance(here, dict | list) and here and chance.random() < 0.85:
        key = chance.choice([*here] if isinstance(here, dict) else range(len(here)))
        path.append((here, key))
        here = here[key]
    if not path:
        return chance.choice(VALUES)
    parent, key = path[-1]
    if chance.random() < 0.2:
        del parent[key]
    else:
        parent[key] = chance.choice(VALUES)
    return content


def extreme(text: str, chance: Random) -> str:
    """A case with one or two of its numbers at an end of what can be."""
    for _ in range(chance.choice([1, 1, 2])):
        old = chance.choice([match for match in NUMBER.finditer(text) if float(match[0])])
        power = chance.choice([1, 1, 2, 3, 6, 12, 30, 100, 300]) * chance.choice([1, -1])
        new = chance.choice(
            [repr(float(old[0]) * 10.0**power), f"1.0e{power}", f"-{old[0]}", "0.0"]
        )
        text = text[: old.start()] + new + text[old.end() :]
    return text


def sane(result: Any) -> None:
    """Raises ValueError where a result holds what no tyre has."""
    text = json.dumps(result)
    for name, low, high in (
        ("mass_kg", 0.1, 1e3),
        ("frequency_Hz", 1.0, 1e5),
        ("area_m2", 1e-6, 1.0),
        ("deflection_m", 0.0, 1.0),
    ):
        for value in map(float, re.findall(rf'"{name}": ([^,}}\n]+)', text)):
            if not low <= value <= high:
                raise ValueError(f"silent nonsense: {name} = {value:g}")
    if re.search("NaN|Infinity", text):
        raise ValueError("silent nonsense: not finite")


def odd(path: Path, outside: Path, chance: Random) -> None:
    """Something else in the place of a file: a link out, a pipe, a device, a folder, too much."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    how = chance.randrange(7)
    if how < 2:
        path.symlink_to(chance.choice([outside / "victim", outside, outside / "none"]))
    elif how == 2:
        path.symlink_to(chance.choice(["/dev/zero", "/dev/tty", "/dev/stdin", path.name]))
    elif how == 3:
        os.mkfifo(path)
    elif how == 4:
        path.mkdir()
    elif how == 5:
        path.touch()
    else:
        path.touch()
        os.truncate(path, 10**11)


def change_file(path: Path, outside: Path, chance: Random) -> None:
    """A file's bytes, its JSON, or the file itself."""
    how = chance.random()
    if how < 0.2:
        odd(path, outside, chance)
    elif how < 0.65 and path.suffix == ".json":
        text = json.dumps(mutated_json(json.loads(path.read_bytes()), chance))
        path.write_text(text, encoding="utf-8", errors="replace")
    else:
        path.write_bytes(mutated(path.read_bytes(), chance))


def run(command: Callable[[list[str]], Any], *arguments: str) -> int:
    """Exit code of a command line."""
    try:
        code = command([*arguments])
    except SystemExit as leave:
        code = leave.code
    return code or 0


class Kinds:
    """Inputs of each kind, made once under ``work``, copied and changed for each trial."""

    def __init__(self, work: Path):
        self.base, self.outside = work / "base", work / "outside"
        if (work / "ready").exists():
            return
        shutil.rmtree(work, ignore_errors=True)
        (self.outside / "run-xyz").mkdir(parents=True)
        for name in ("victim", "run-xyz/file", "modes.json"):
            (self.outside / name).write_text("precious")
        cases = self.base / "cases"
        cases.mkdir(parents=True)
        shutil.copy(CASES / "p235_75r17.csv", cases)
        text = (CASES / "p235_75r17.yaml").read_text().replace("level: default", "level: coarse")
        (cases / "case.yaml").write_text(text)
        case, folder = str(cases / "case.yaml"), str(self.base / "folders")
        with contextlib.redirect_stdout(io.StringIO()):
            for study in (["modes"], ["fit", "--no-pictures"], ["sweep-pressure", "--steps", "2"]):
                assert run(tyrecal, study[0], case, *study[1:], "--output", folder) == 0
            decks = str(self.base / "decks")
            assert run(tyrecal, "deck", case, "--output", decks) == 0
        for number, way in enumerate(WAYS):
            folder = self.base / "universal" / str(number)
            folder.mkdir(parents=True)
            universal_files(folder, way, points=8, binary=number % 2)
        (self.base / "records").mkdir()
        record = next((self.base / "folders" / "record").glob("*/*.record"))
        place = self.base / "records" / record.parent.name
        place.mkdir()
        shutil.move(record, place)
        shutil.rmtree(self.base / "folders" / "record")
        (work / "ready").touch()

    def records(self, here: Path, chance: Random) -> int:
        """A record read for its key, labelled as `modes` does, and the store verified."""
        store = Path(shutil.copytree(self.base / "records", here / "store"))
        (path,) = store.glob("*/*.record")
        key, how = path.stem, chance.random()
        line, _, stored = path.read_bytes()[65:].partition(b"\n")
        if how < 0.15:
            odd(chance.choice([path, path, path.parent]), self.outside, chance)
        elif how < 0.3:
            path.write_bytes(mutated(path.read_bytes(), chance))
        else:  # with the right checksum
            if how < 0.75:
                line = json.dumps(mutated_json(json.loads(line), chance)).encode()
            else:
                stored = mutated(stored, chance)
            body = line + b"\n" + stored
            path.write_bytes(sha256(body).hexdigest().encode() + b"\n" + body)
        content = Store(store).read(key)
        if content is not None and "answer" in content:
            paired_labels(evaluation(content["answer"]).modes)
        return run(tyrecal, "store", str(store), "--verify", "--prune", "0")

    def cases(self, here: Path, chance: Random) -> int:
        """A case validated, and its decks written."""
        folder = Path(shutil.copytree(self.base / "cases", here / "cases"))
        name = "case.yaml" if chance.random() < 0.75 else "p235_75r17.csv"
        change_file(folder / name, self.outside, chance)
        case = str(folder / "case.yaml")
        code = run(tyrecal, "validate", case)
        if chance.random() < 0.2:
            code = run(tyrecal, "deck", case, "--output", str(here / "decks"))
        return code

    def folders(self, here: Path, chance: Random) -> int:
        """A results folder told on a page, or written to by a study."""
        folder = Path(shutil.copytree(self.base / "folders", here / "out"))
        if chance.random() < 0.25:
            names = (
                "runs",
                "previous",
                "record",
                ".new-x",
                ".lock",
                "modes.inp",
                "report.html",
                ".report.html.partial",
                "diagnosis.md",
                "diagnosis.json",
                "footprint.json",
            )
            odd(folder / chance.choice(names), self.outside, chance)
        else:
            files = sorted(path for path in folder.iterdir() if path.is_file())
            change_file(chance.choice(files), self.outside, chance)
        if chance.random() < 0.75:
            return run(tyrecal, "report", str(folder))
        return run(tyrecal, "deck", str(self.base / "cases" / "case.yaml"), "--output", str(folder))

    def universal(self, here: Path, chance: Random) -> int:
        """A universal file imported, as sets of every kind or with the sensors alone."""
        (path,) = (self.base / "universal" / str(chance.randrange(len(WAYS)))).iterdir()
        file = Path(shutil.copy(path, here))
        change_file(file, self.outside, chance)
        given = ["--highest-harmonic", "6"] * (chance.random() < 0.7)
        given += ["--directions", "cylindrical"] * (chance.random() < 0.3)
        if chance.random() < 0.2:
            return run(tyrecal, "measured", "sensors", str(file), *given)
        given += ["--pressure-kPa", "240", "--sigma-percent", "0.3", "--no-pictures"]
        out = str(here / "measured.csv")
        return run(tyrecal, "measured", "import", str(file), *given, "--output", out)

    def fits(self, here: Path, chance: Random) -> int:
        """A fit with numbers that are valid, but of no tyre."""
        return self._extreme(here, chance, "fit")

    def footprints(self, here: Path, chance: Random) -> int:
        """A tyre of such numbers on the road."""
        return self._extreme(here, chance, "footprint")

    def _extreme(self, here: Path, chance: Random, study: str) -> int:
        folder = Path(shutil.copytree(self.base / "cases", here / "cases"))
        case = folder / "case.yaml"
        usual = case.read_text()
        for what, instead in WITH_MORE:
            usual = re.sub(what, instead, usual, flags=re.M)
        unusual = ["--allow-unusual"] * (chance.random() < 0.5)
        for _ in range(100):  # until one is valid
            case.write_text(extreme(usual, chance))
            with contextlib.redirect_stderr(io.StringIO()) as refused:
                code = run(tyrecal, "validate", str(case), *unusual)
            if not code:
                break
        else:
            print(refused.getvalue(), file=sys.stderr)
            return code
        pairs = zip(usual.splitlines(), case.read_text().splitlines(), strict=True)
        print(*unusual, *(new.strip() for old, new in pairs if old != new), sep="; ")
        out = here / "out"
        warned = io.StringIO()
        with contextlib.redirect_stderr(warned):
            code = run(tyrecal, study, str(case), *unusual, "--no-pictures", "--output", str(out))
        print(warned.getvalue(), file=sys.stderr)
        if not code and "warning" not in warned.getvalue():
            sane(json.loads((out / f"{study}.json").read_text()))
        return code

    def decks(self, here: Path, chance: Random) -> int:
        """A deck given to the bundled solver."""
        folder = Path(shutil.copytree(self.base / "decks", here / "decks"))
        name = chance.choice(["inflate.inp", "inflate.inp", "modes.inp"])
        change_file(folder / name, self.outside, chance)
        return self._solve(folder)

    def requests(self, here: Path, chance: Random) -> int:
        """Mutate the request file next to a deck, and solve."""
        folder = Path(shutil.copytree(self.base / "decks", here / "decks"))
        change_file(folder / "modes.request.json", self.outside, chance)
        return self._solve(folder)

    def _solve(self, folder: Path) -> int:
        limit = ("--time-limit", str(CPU_S / 2))
        return run(solve, str(folder / "modes"), "--oldjob", "inflate", *limit)

    def state(self) -> dict[str, Any]:
        """Return what must stay as it is."""
        return {
            str(path): path.read_bytes() if path.is_file() else None
            for top in (self.outside, self.base)
            for path in top.rglob("*")
            if not (path.name == ".lock" or path.suffix == ".damaged")
        }


NAMES = ("records", "cases", "folders", "decks", "requests", "universal")
LONG = ("fits", "footprints")


def trial(kinds: Kinds, kind: str, number: int, seed: int) -> dict[str, Any]:
    """Try one input; ``fault`` states what was wrong, "" if nothing was."""
    chance, fault, code = Random(f"{seed}/{kind}/{number}"), "", 0
    out, err = io.StringIO(), io.StringIO()
    before, used = kinds.state(), time.process_time()
    limit = LONG_S if kind in LONG else CPU_S
    signal.setitimer(signal.ITIMER_PROF, limit)
    with tempfile.TemporaryDirectory(dir=kinds.base.parent) as here:
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                code = getattr(kinds, kind)(Path(here), chance)
        except Slow:
            fault = f"more than {limit} s"
        except BaseException as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{Path(place.filename).name}:{place.lineno}"
            fault = f"traceback: {type(error).__name__}: {error} ({where})"
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
    message = err.getvalue()
    if kind == "universal" and resource.getrusage(resource.RUSAGE_SELF).ru_maxrss > MEASURED_kB:
        fault = fault or "more than 1 GB"
    if not fault and code not in CODES:
        fault = f"code {code}"
    elif not fault and code and not message.strip():
        fault = f"code {code} without a word"
    elif "\x1b" in message or "\x07" in message:
        fault = fault or "a control character reached the terminal"
    if kinds.state() != before:
        fault = "FILES OUTSIDE WERE CHANGED " + fault
    seconds = round(time.process_time() - used, 2)
    return {
        "kind": kind,
        "number": number,
        "code": code,
        "seconds": seconds,
        "fault": fault[:300],
        **({"said": (out.getvalue()[:300], message[-600:])} if kind in LONG else {}),
    }


def _raise_slow(*_: object) -> None:
    raise Slow


def trials(kinds: Kinds, kind: str, numbers: list[int], seed: int) -> Iterator[dict[str, Any]]:
    """Trials in forked processes, a batch each, so that what one breaks stays with it."""
    waiting = list(numbers)
    while waiting:
        reader, writer = os.pipe()
        process = os.fork()
        if not process:
            with contextlib.suppress(BaseException), os.fdopen(writer, "w") as pipe:
                os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
                signal.signal(signal.SIGPROF, _raise_slow)
                signal.signal(signal.SIGALRM, signal.SIG_DFL)
                resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
                for number in waiting[:BATCH]:
                    signal.alarm(WALL_S)
                    print(json.dumps(trial(kinds, kind, number, seed)), file=pipe, flush=True)
            os._exit(0)
        os.close(writer)
        with os.fdopen(reader) as pipe:
            for line in pipe:
                waiting.pop(0)
                yield json.loads(line)
        _, status = os.waitpid(process, 0)
        if status:  # killed in the middle of one
            yield {
                "kind": kind,
                "number": waiting.pop(0),
                "code": -1,
                "seconds": WALL_S,
                "fault": f"killed, status {status}",
            }


def main() -> int:
    """Run what has not been run, and count."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=NAMES + LONG, action="append")
    parser.add_argument("--only", type=int)
    parser.add_argument("--output", type=Path, default=Path("mutated.jsonl"))
    given = parser.parse_args()
    done: list[dict[str, Any]] = []
    if given.output.exists():
        done = [json.loads(line) for line in given.output.read_text().splitlines()]
    with tempfile.TemporaryDirectory(prefix="mutated-") as work:
        kinds = Kinds(Path(work) / "inputs")
        for kind in given.kind or NAMES:
            known = {each["number"] for each in done if each["kind"] == kind}
            numbers = [n for n in range(given.count) if n not in known]
            if given.only is not None:
                numbers = [given.only]
            with given.output.open("a", encoding="utf-8") as file:
                for result in trials(kinds, kind, numbers, given.seed):
                    done.append(result)
                    print(json.dumps(result), file=file, flush=True)
                    if result["fault"] or given.only is not None:
                        print(json.dumps(result), flush=True)
    for kind in given.kind or NAMES:
        own = [each for each in done if each["kind"] == kind]
        codes = Counter(each["code"] for each in own)
        slowest = max((each["seconds"] for each in own), default=0.0)
        faults = sum(bool(each["fault"]) for each in own)
        print(
            f"{kind}: {len(own)}, codes {dict(sorted(codes.items()))}, slowest {slowest:g} s,"
            f" wrong {faults}"
        )
    return int(any(each["fault"] for each in done))


if __name__ == "__main__":
    sys.exit(main())
