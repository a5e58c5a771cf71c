"""Mutants of the decks that we write for ABAQUS, and of a user's in three dimensions: each breaks
one thing that its manual asks.

python -m tests.deck.abaqus_mutants [--count N] [--seed S]: how many of each kind the grammar of
`solvers/language/table.py` catches. The kinds are of texts, and know nothing of the grammar.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Callable
from difflib import unified_diff
from functools import cache
from random import Random

from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.language.text import DeckError, read_keywords

from ..solvers import decks_3d
from ..tyre.own_deck_mutants import misspelt
from . import abaqus_decks

Mutant = Callable[[list[str], Random], list[str]]  # of a deck's lines
ONCE: tuple[str, ...] = (
    "FILE FORMAT",
    "HEADING",
    "STATIC",
    "FREQUENCY",
    "SYMMETRIC MODEL",
    "SYMMETRIC RESULTS",
)
ONCE += ("DENSITY", "HYPERELASTIC", "ELASTIC")
NEEDED: tuple[str, ...] = (
    "END STEP",
    "MATERIAL",
    "STATIC",
    "FREQUENCY",
    "SYMMETRIC MODEL",
    "SOLID SECTION",
    "STEP",
)
NEEDED += ("SURFACE, NAME", "NSET, NSET=RIM", "SURFACE INTERACTION", "MASS,", "SPRING,")
OF_STEPS: tuple[str, ...] = (
    "STATIC",
    "DSLOAD",
    "DLOAD",
    "CLOAD",
    "NODE FILE",
    "MODAL FILE",
    "CONTACT CONTROLS",
)
OF_MODEL: tuple[str, ...] = (
    "MATERIAL",
    "SOLID SECTION",
    "RIGID BODY",
    "NODE",
    "ELEMENT",
    "SURFACE",
    "CONTACT PAIR",
)
OPTIONS: tuple[str, ...] = (
    "REBAR LAYER",
    "HOURGLASS STIFF",
    "DENSITY",
    "HYPERELASTIC",
    "VISCO",
    "FRICTION",
)
OPTIONS += ("SURFACE BEHAVIOR", "ELASTIC")
WITHOUT_DATA: tuple[str, ...] = (
    "MATERIAL",
    "SURFACE SECTION",
    "RESTART",
    "END STEP",
    "MODAL FILE",
    "FILE FORMAT",
)
WITH_DATA: tuple[str, ...] = (
    "NODE",
    "ELEMENT",
    "REBAR LAYER",
    "DENSITY",
    "ELASTIC",
    "HYPERELASTIC",
    "BOUNDARY",
)
WITH_DATA += ("DSLOAD", "DLOAD", "CLOAD", "SPRING", "MASS", "CONTACT PAIR", "SYMMETRIC MODEL")
NUMBERS: tuple[str, ...] = (
    "NODE",
    "DENSITY",
    "ELASTIC",
    "HYPERELASTIC",
    "REBAR LAYER",
    "DSLOAD",
    "CLOAD",
    "MASS",
)
AFTER = {"inflate": ("modes", "press"), "ring": ("ring's modes",)}  # that go on from a job
SHAPES = "*NODE FILE, NSET=CROWN\nU, COORD\n*MODAL FILE\n*END STEP"
EXCLUDED = {
    "HYPERELASTIC": ("NEO HOOKE", "OGDEN"),
    "FRICTION": ("ROUGH", "LAGRANGE"),
    "SYMMETRIC MODEL": ("REFLECT=LINE", "PERIODIC=CONSTANT"),
}
REQUIRED: tuple[str, ...] = (
    "MATERIAL=",
    "ELSET=",
    "NAME=",
    "REF NODE=",
    "TYPE=CGAX",
    "INTERACTION=",
    "NSET=RIM",
)


def keywords(lines: list[str], names: tuple[str, ...] = ("",)) -> list[int]:
    """Places of keyword lines that begin with one of some words."""
    starts = tuple("*" + name for name in names)
    return [
        k for k, line in enumerate(lines) if line.startswith(starts) and not line.startswith("**")
    ]


def end(lines: list[str], k: int) -> int:
    """Line at which the block of a keyword ends."""
    return next((j for j in range(k + 1, len(lines)) if lines[j].startswith("*")), len(lines))


def data(lines: list[str], names: tuple[str, ...], random: Random) -> int:
    """A data line of one of some keywords."""
    k = random.choice([k for k in keywords(lines, names) if end(lines, k) > k + 1])
    return random.randrange(k + 1, end(lines, k))


def moved(lines: list[str], k: int, to: int) -> list[str]:
    """A keyword with its data before another line."""
    block, rest = lines[k : end(lines, k)], lines[:k] + lines[end(lines, k) :]
    to = to if to <= k else to - len(block)
    return rest[:to] + block + rest[to:]


def misspelt_keyword(lines: list[str], random: Random) -> list[str]:
    k = random.choice(keywords(lines))
    word = lines[k][1:].split(",")[0]
    return [*lines[:k], lines[k].replace(word, misspelt(word, random), 1), *lines[k + 1 :]]


def misspelt_option(lines: list[str], random: Random) -> list[str]:
    k = random.choice([k for k in keywords(lines) if "," in lines[k]])
    head, *rest = lines[k].split(", ")
    j = random.randrange(len(rest))
    name, equals, value = rest[j].partition("=")
    rest[j] = misspelt(name, random) + equals + value
    return [*lines[:k], ", ".join([head, *rest]), *lines[k + 1 :]]


def misspelt_word(lines: list[str], random: Random) -> list[str]:
    """Mutants in which a word that an option may have is misspelt."""
    words = r"(?<==)(YES|LONG TERM|PRONY|TABULAR|STIFFNESS|ELEMENT|LANCZOS|MASS|NEW|LINEAR)$"
    words = words.replace("$", r"(?=,|$)")
    k = random.choice([k for k in keywords(lines) if re.search(words, lines[k])])
    match = random.choice(list(re.finditer(words, lines[k])))
    text = lines[k][: match.start()] + misspelt(match[0], random) + lines[k][match.end() :]
    return [*lines[:k], text, *lines[k + 1 :]]


def dropped_option(lines: list[str], random: Random) -> list[str]:
    """Mutants without an option that must be given."""
    pattern = rf", ({'|'.join(REQUIRED)})[^,]*"
    must = (
        r"\*(SOLID SEC|SURFACE|MATERIAL|SECTION|RIGID|ELSET|NSET|CONTACT PAIR|MASS|SPRING|ROTARY)"
    )
    may = [k for k in keywords(lines) if re.match(must, lines[k]) and re.search(pattern, lines[k])]
    may += [k for k in keywords(lines, ("ELEMENT",)) if "TYPE=CGAX" in lines[k]]
    k = random.choice(may)
    one = ", TYPE=[^,]*" if lines[k].startswith("*ELEMENT") else pattern
    return [*lines[:k], re.sub(one, "", lines[k], count=1), *lines[k + 1 :]]


def excluded_option(lines: list[str], random: Random) -> list[str]:
    k = random.choice(keywords(lines, tuple(EXCLUDED)))
    more = next(v for name, v in EXCLUDED.items() if lines[k].startswith("*" + name))
    return [*lines[:k], f"{lines[k]}, {random.choice(more)}", *lines[k + 1 :]]


def of_a_step_in_the_model(lines: list[str], random: Random) -> list[str]:
    return moved(lines, random.choice(keywords(lines, OF_STEPS)), keywords(lines, ("STEP",))[0])


def of_the_model_in_a_step(lines: list[str], random: Random) -> list[str]:
    model = keywords(lines[: keywords(lines, ("STEP",))[0]], OF_MODEL)
    model = [k for k in model if not lines[k].startswith("*NODE FILE")]
    return moved(lines, random.choice(model), random.choice(keywords(lines, ("END STEP",))))


def orphaned_option(lines: list[str], random: Random) -> list[str]:
    """An option of a material, section or interaction away from it."""
    k = random.choice(keywords(lines, OPTIONS))
    return moved(lines, k, random.choice(keywords(lines, ("NODE", "ELSET", "SYMMETRIC"))))


def doubled(lines: list[str], random: Random) -> list[str]:
    k = random.choice(keywords(lines, ONCE))
    return lines[: end(lines, k)] + lines[k : end(lines, k)] + lines[end(lines, k) :]


def deleted(lines: list[str], random: Random) -> list[str]:
    """A keyword, with its data, that others rest on."""
    k = random.choice(keywords(lines, NEEDED))
    return lines[:k] + lines[end(lines, k) :]


def data_missing(lines: list[str], random: Random) -> list[str]:
    """Mutants without all data lines of a keyword that has some; with OP=NEW it may have none."""
    may = [k for k in keywords(lines, WITH_DATA) if not re.search("NODE FILE|OP=NEW", lines[k])]
    k = random.choice(may)
    return lines[: k + 1] + lines[end(lines, k) :]


def data_too_many(lines: list[str], random: Random) -> list[str]:
    k = random.choice(keywords(lines, WITHOUT_DATA))
    return [*lines[: k + 1], "1.0, 2.0", *lines[k + 1 :]]


def field_too_many(lines: list[str], random: Random) -> list[str]:
    k = data(lines, ("DENSITY", "BOUNDARY", "ELASTIC", "ELEMENT", "CLOAD", "CONTACT PAIR"), random)
    return [*lines[:k], lines[k] + ", 7" * 4, *lines[k + 1 :]]


def field_missing(lines: list[str], random: Random) -> list[str]:
    k = data(lines, ("ELEMENT", "CLOAD", "BOUNDARY", "DSLOAD", "DENSITY"), random)
    fields = lines[k].split(",")
    fields[random.randrange(min(len(fields), 2))] = " "
    return [*lines[:k], ",".join(fields), *lines[k + 1 :]]


def no_number(lines: list[str], random: Random) -> list[str]:
    """Letters, two points, or too many digits in a number."""
    k = data(lines, NUMBERS, random)
    fields = lines[k].split(",")
    places = [j for j, text in enumerate(fields) if re.match(r"\s*[-+\d.]", text)]
    j = random.choice(places)
    text = fields[j].strip()
    fields[j] = random.choice((text + "x", text + "..", text + "0" * 25, "1.0.0", "1,5e"))
    return [*lines[:k], ", ".join(fields), *lines[k + 1 :]]


def dangling(lines: list[str], random: Random) -> list[str]:
    """A name that nobody gives."""
    uses = r"\*(SOLID SECTION|SURFACE SECTION|RIGID|CONTACT|MASS|SPRING|ROTARY|NODE FILE)"
    named = r"(?<==)[A-Z_][A-Z_0-9]*(?=,|$)"
    places = [
        (k, match)
        for k in keywords(lines)
        if re.match(uses, lines[k])
        for match in re.finditer(
            rf"(?:SET|MATERIAL|INTERACTION|SLAVE|MASTER|SURFACE|CONTROLS){named}", lines[k]
        )
    ] or [
        (k, match)
        for k in keywords(lines)
        if re.match(uses, lines[k])
        for match in re.finditer(named, lines[k])
        if not lines[k][: match.start()].endswith("TYPE=")
    ]
    for j, line in enumerate(lines):
        if not line.startswith("*") and (
            match := re.match(r"(CAVITY|TREAD|ROAD|INNER_ROW)\b", line)
        ):
            places.append((j, match))
    k, match = random.choice(places)
    return [*lines[:k], f"{lines[k][: match.end()]}_X{lines[k][match.end() :]}", *lines[k + 1 :]]


def wrong_element(lines: list[str], random: Random) -> list[str]:
    """Give an element another type, a node too few, or a node that does not exist."""
    k = random.choice([k for k in keywords(lines, ("ELEMENT",)) if "GAX" in lines[k]])
    j = random.randrange(k + 1, end(lines, k))
    how = random.randrange(3)
    if how == 0:
        other = lines[k].replace("CGAX8", "CGAX4").replace("SFMGAX2", "SFMGAX1")
        other = other if other != lines[k] else lines[k].replace("X4", "X8").replace("AX1", "AX2")
        return [*lines[:k], other, *lines[k + 1 :]]
    fields = lines[j].split(",")
    fields = fields[:-1] if how == 1 else [*fields[:-1], " 7777777"]
    return [*lines[:j], ",".join(fields), *lines[j + 1 :]]


KINDS: dict[str, Mutant] = {
    name.replace("_", " "): kind
    for name, kind in globals().copy().items()
    if getattr(kind, "__annotations__", {}).get("return") == "list[str]" and name != "moved"
}


@cache
def decks() -> dict[str, list[str]]:
    """The texts by their job."""
    inflated = decks_3d.inflate().replace(decks_3d.MARKED, "4.5E6")
    return {
        "inflate": list(abaqus_decks.inflations()),
        "modes": list(abaqus_decks.modes()),
        "press": list(abaqus_decks.presses()),
        "ring": [decks_3d.mesh().replace(",\n", ", ") + inflated[inflated.index("*SOLID") :]],
        "ring's modes": [decks_3d.modes(calculix=False).replace("*END STEP", SHAPES)],
    }


def caught(job: str, lines: list[str]) -> bool:
    """Return whether the grammar finds a mistake in the deck, or in one that continues it. A
    text that is no deck is caught by its reader."""
    try:
        blocks = read_keywords("\n".join(lines))
    except DeckError:
        return True
    before = next((first for first, jobs in AFTER.items() if job in jobs), None)
    if before:
        return bool(findings(blocks, read_keywords(decks()[before][-1])))
    after = [decks()[other][0] for other in AFTER[job]]
    return bool(findings(blocks) or any(findings(read_keywords(text), blocks) for text in after))


def draw(count: int, seed: int) -> list[tuple[str, bool, list[str]]]:
    """Kind, whether it is caught, and what it changed."""
    random, results = Random(seed), list[tuple[str, bool, list[str]]]()
    while len(results) < count:
        kind, job = random.choice(list(KINDS)), random.choice(list(decks()))
        lines = [line for line in random.choice(decks()[job]).splitlines() if line.strip()]
        try:
            wrong = KINDS[kind](lines, random)
        except IndexError:  # the deck has nothing of the kind
            continue
        if wrong != lines:
            change = list(unified_diff(lines, wrong, job, kind, n=0, lineterm=""))
            results.append((kind, caught(job, wrong), change))
    return results


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    results = draw(given.count, given.seed)
    drawn, seen = Counter(k for k, *_ in results), Counter(k for k, ok, _ in results if ok)
    print("| mutants | drawn | caught |\n|---|---|---|")
    for kind in KINDS:
        print(f"| {kind} | {drawn[kind]} | {seen[kind]} |")
    print(f"| all | {len(results)} | {sum(seen.values())} |")
    for kind, ok, change in results:
        if not ok:
            print(kind, *change, sep="\n  ")


if __name__ == "__main__":
    main()
