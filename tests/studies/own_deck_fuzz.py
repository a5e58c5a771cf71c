"""Damaged user decks, sizes that take the machine among them: no traceback, 10 s and 1 GB at most.

python -m tests.studies.own_deck_fuzz [--count N] [--seed S]: each mutant of the small tyre's decks
is read, checked and tried in a process of its own. What is expected: refused by line, the same
tyre, or another tyre where a number was exchanged; none ends otherwise. Seconds are of the
processor, so that a busy machine does not count.
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import sys
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from tyrecal.simulate.deck.own import asked_by_abaqus, lacking_in_calculix
from tyrecal.tyre.case.kinds.section_deck import trial
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.summary import contents
from tyrecal.tyre.own_deck.text import OwnDeckError

from ..tyre import maker_decks, own_decks, test_contact

LONGEST_S, MOST_BYTES = 10, 1 << 30
NUMBERS: tuple[str, ...] = (
    "0",
    "-1",
    "1e9",
    "1000000000",
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "",
    "1e-320",
    "7 7",
    "x",
)
NUMBERS += ("9" * 5000, "1" + "0" * 100_000, "-" * 50, "{{ a }}", "<b>", "0x10", "1_000", "\uff11")
HUGE = (
    "*NSET, NSET=H, GENERATE\n1, 1000000000, 1",
    "*ELSET, ELSET=H, GENERATE\n1, 1000000000",
    "*NGEN\n1001, 1000001001, 1",
    "*NFILL\nRIM, RIM, 1000000000, 1",
    "*NFILL, BIAS=1e300\nRIM, ALL, 1000, 1",
    "*NCOPY, OLD SET=RIM, CHANGE NUMBER=1000000, SHIFT, MULTIPLE=1000000000\n0.1, 0., 0.",
    "*NCOPY, OLD SET=NONE, CHANGE NUMBER=1, SHIFT, MULTIPLE=1000000000\n0.1, 0., 0.",
    "*ELGEN\n1, 1000000000, 0, 0",
    "*ELGEN\n1, 100000, 0, 1, 100000, 0, 100000",
    "*PARAMETER\na = " + "(" * 2000 + "1" + ")" * 2000,
    "*PARAMETER\na = " + "9**" * 50 + "9",
    "*PARAMETER\na = 10**100\nb = a**100\nc = b**100\nd = c**100",
    "*PARAMETER\na = 'x'*1000000000",
    "*PARAMETER\na = " + "-" * 900 + "1",
    "*ELEMENT, TYPE=CGAX8R" + ",\n" * 3000,
    "*NODE\n1, " + "1" * 100_000,
    "*" + "X" * 100_000,
    "*INCLUDE, INPUT=tyre.inp",
    "*NODE, INPUT=tyre.inp",
    "*NSET, NSET=A\nB\n*NSET, NSET=B\nA",
    "*SYSTEM\n1e308, 0., 0., -1e308, 0., 0.",
    "\0" * 100_000,
    "," * 100_000,
)


def numbers(text: str, random: Random) -> str:
    """Exchange one field of a data line."""
    lines = text.split("\n")
    k = random.choice([k for k, line in enumerate(lines) if line and line[0] != "*"])
    fields = lines[k].split(",")
    fields[random.randrange(len(fields))] = random.choice(NUMBERS)
    lines[k] = ",".join(fields)
    return "\n".join(lines)


def option(text: str, random: Random) -> str:
    """The value of one option exchanged, or an option from another keyword added."""
    lines = text.split("\n")
    heads = [k for k, line in enumerate(lines) if line[:1] == "*" and line[:2] != "**"]
    k = random.choice(heads)
    parts = lines[k].split(",")
    if len(parts) > 1 and random.random() < 0.6:
        j = random.randrange(1, len(parts))
        parts[j] = f"{parts[j].partition('=')[0]}={random.choice(NUMBERS)}"
    else:
        parts += random.choice([lines[other] for other in heads]).split(",")[1:]
    lines[k] = ",".join(parts)
    return "\n".join(lines)


def lines_moved(text: str, random: Random) -> str:
    """A few lines deleted, doubled, exchanged, or moved."""
    lines = text.split("\n")
    for _ in range(random.randint(1, 4)):
        a, b = random.randrange(len(lines)), random.randrange(len(lines))
        what = random.randrange(4)
        if what == 0:
            del lines[min(a, b) : min(a, b) + random.randint(1, 5)]
        elif what == 1:
            lines[a:a] = lines[b : b + random.randint(1, 5)]
        elif what == 2:
            lines[a], lines[b] = lines[b], lines[a]
        else:
            lines.insert(a, lines.pop(b))
        lines = lines or [""]
    return "\n".join(lines)


def characters(text: str, random: Random) -> str:
    """A few characters exchanged, or the text cut off."""
    if random.random() < 0.2:
        return text[: random.randrange(len(text))]
    letters = list(text)
    for _ in range(random.randint(1, 6)):
        letters[random.randrange(len(letters))] = random.choice(
            "*,=\n\r\t\0\"'<>{}#.-+eEdD0179 é\ufeff"
        )
    return "".join(letters)


def huge(text: str, random: Random) -> str:
    """A block that asks for more than a machine has, before a keyword of the deck."""
    places = [k for k in range(len(text)) if text.startswith("\n*", k)]
    k = random.choice(places)
    return f"{text[:k]}\n{random.choice(HUGE)}{text[k:]}"


KINDS: tuple[Callable[[str, Random], str], ...] = (numbers, option, lines_moved, characters, huge)


def judged(path: Path) -> str:
    """Return how a deck ends: refused, read, or the fault."""
    try:
        deck = read_own_deck(path, "m")
        blocks = deck.with_numbers({})
        asked_by_abaqus(blocks)
        lacking_in_calculix(blocks)
        deck.sha256  # noqa: B018
        flat = deck.flat({})
        trial(flat)
        contents(deck, flat)
    except OwnDeckError as error:
        return "refused" if len(str(error)) < 1000 else "a refusal of many words"
    except Exception as error:
        at = traceback.extract_tb(sys.exc_info()[2])[-1]
        return (
            f"{type(error).__name__} in {Path(at.filename).name}, line {at.lineno}: {error!s:.80}"
        )
    return "read"


def apart(path: Path) -> tuple[str, float]:
    """The same in a process of its own with limits of time and memory, and its seconds."""
    here, there = os.pipe()
    if not (child := os.fork()):
        os.close(here)
        in_use = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (in_use + MOST_BYTES,) * 2)
        signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
        os.write(there, judged(path).encode())
        os._exit(0)
    os.close(there)
    with os.fdopen(here, "rb") as stream:
        words = stream.read().decode()
    _, status, usage = os.wait4(child, 0)
    ended = "too slow" if os.WIFSIGNALED(status) else "ended without a word"
    return words or ended, usage.ru_utime + usage.ru_stime


def draw(count: int, seed: int) -> list[tuple[str, str, float, str]]:
    """Kind, judgement, seconds and text of each mutant."""
    random, mutants = Random(seed), list[tuple[str, str, float, str]]()
    texts = [style() for style in (own_decks.plain, *own_decks.STYLES.values())]
    makers = ("lifted_membranes", "parts_of_cae", "half_section", "rim_in_contact")
    texts += [maker_decks.DECKS[name]()[f"{name}.inp"] for name in makers]
    texts += [test_contact.STYLES["elements"], test_contact.STYLES["instances"]]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "tyre.inp"
        for _ in range(count):
            kind = random.choice(KINDS)
            text = kind(random.choice(texts), random)
            path.write_text(text, encoding="utf-8")
            mutants.append((kind.__name__, *apart(path), text))
    return mutants


def sizes() -> list[str]:
    """Return how the plain deck ends with each of `HUGE`."""
    text = own_decks.plain()
    at = text.index("*RIGID BODY")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "tyre.inp"
        mutants = []
        for more in HUGE:
            path.write_text(f"{text[:at]}{more}\n{text[at:]}", encoding="utf-8")
            mutants.append(apart(path)[0])
    return mutants


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args()
    mutants = draw(given.count, given.seed)
    for (kind, how), many in sorted(Counter((kind, how) for kind, how, *_ in mutants).items()):
        print(f"{many:6} {kind:12} {how}")
    print(f"slowest {max(seconds for _, _, seconds, _ in mutants):.2f} s")
    for n, (kind, how, _, text) in enumerate(mutants):
        if given.keep and how not in ("refused", "read"):
            (given.keep / f"{n}_{kind}.inp").write_text(text)


if __name__ == "__main__":
    main()
