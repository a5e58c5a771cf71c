"""Wrong decks: the small tyre in some style, with one mistake of a kind that people make.

python -m tests.tyre.own_deck_mutants [--count N] [--seed S]: all are refused by line, or, where the
mistake changes nothing, are the same flat deck.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from tyrecal.tyre.case.kinds.section_deck import trial
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.solver_deck import SolverDeck
from tyrecal.tyre.own_deck.text import OwnDeckError

from . import maker_decks, own_decks, test_contact

UNSUPPORTED_MODEL = (
    "*CONTACT PAIR, INTERACTION=I\nCAVITY, CAVITY",
    "*MPC\nTIE, 1001, 1003",
    "*EQUATION\n2\n1001, 1, 1.0, 1003, 1, -1.0",
    "*INITIAL CONDITIONS, TYPE=STRESS\nSOLID, 1.0E3",
    "*TRANSFORM, NSET=RIM\n1., 0., 0., 0., 1., 0.",
    "*SHELL SECTION, ELSET=BELT, MATERIAL=CORD\n0.001",
    "*ELEMENT, TYPE=MASS, ELSET=M\n77777, 1001",
    "*ELEMENT, TYPE=SPRING1, ELSET=S\n77778, 1001",
    "*BOUNDARY\n1005, 1, 1",
    "*SYMMETRIC MODEL GENERATION, REVOLVE\n0.,0.,0.,0.,1.,0.\n1.,0.,0.\n360., 60, 1.",
)
UNSUPPORTED_STEP = (
    "*CLOAD\n1005, 1, 5.0",
    "*TEMPERATURE\nSOLID, 50.",
    "*DLOAD\nSOLID, CENTRIF, 100.",
    "*DLOAD\nSOLID, GRAV, 9.81, 1., 0., 0.",
    "*MODEL CHANGE, REMOVE\nBELT",
    "*BOUNDARY\n900001, 1, 1, 0.001",
    "*FIELD\nSOLID, 1.",
)
UNSUPPORTED_MATERIAL = (
    "*PLASTIC\n1.0E6, 0.0",
    "*HYSTERESIS\n1.6, 5.0, 4.0, -1.0",
    "*MULLINS EFFECT\n2.0, 1.0E5, 0.1",
    "*HYPERFOAM, N=1\n1.E5, 2.0, 0.1",
    "*USER MATERIAL, CONSTANTS=1\n1.0",
)
Mutant = Callable[[str, Random], str]


def lines_with(text: str, pattern: str) -> list[int]:
    """Places of lines."""
    return [k for k, line in enumerate(text.splitlines()) if re.match(pattern, line, re.I)]


def misspelt(word: str, random: Random) -> str:
    """With a letter gone, doubled or exchanged; no beginning of the word, which is legal."""
    letters = [k for k, c in enumerate(word) if c.isalpha() and c not in "qQ"]
    k = random.choice(letters[1:] or letters)
    wrong = random.choice(
        (word[:k] + word[k + 1 :], word[:k] + word[k] + word[k:], word[:k] + "q" + word[k + 1 :])
    )
    return f"q{word}" if word.startswith(wrong) else wrong


def in_line(text: str, k: int, change: Callable[[str], str]) -> str:
    lines = text.splitlines()
    lines[k] = change(lines[k])
    return "\n".join(lines) + "\n"


def keyword(text: str, random: Random) -> str:
    """A misspelt keyword."""
    stop = lines_with(text, r"\*END STEP")[0]
    places = [k for k in lines_with(text, r"\*\w") if k <= stop]

    def change(line: str) -> str:
        word = line[1:].split(",")[0].strip()
        return line.replace(word, misspelt(word, random), 1)

    return in_line(text, random.choice(places), change)


def option(text: str, random: Random) -> str:
    """A misspelt option, or value of it."""
    stop = lines_with(text, r"\*END STEP")[0]
    harmless = r"\*(OUTPUT|RESTART|PREPRINT|HEADING)"
    places = [
        k
        for k in lines_with(text, r"\*\w.*,.*\w")
        if k <= stop and k not in lines_with(text, harmless)
    ]

    def change(line: str) -> str:
        head, *rest = line.split(",")
        rest = [part for part in rest if part.strip()]
        j = random.randrange(len(rest))
        name, equals, value = rest[j].partition("=")
        if equals and random.random() < 0.5 and value.strip(' "').replace("-", "").isalpha():
            value = value.replace(value.strip(), misspelt(value.strip(), random))
        else:
            name = name.replace(name.strip(), misspelt(name.strip(), random))
        rest[j] = name + equals + value
        return ",".join([head, *rest])

    return in_line(text, random.choice(places), change)


def unsupported(text: str, random: Random) -> str:
    """A keyword that is not honoured, where ABAQUS would take it."""
    where, what = random.choice(
        (
            (r"\*STEP", random.choice(UNSUPPORTED_MODEL)),
            (r"\*END STEP", random.choice(UNSUPPORTED_STEP)),
            (r"\*DENSITY", random.choice(UNSUPPORTED_MATERIAL)),
        )
    )
    k = random.choice(
        lines_with(text, where)[:2] if "DENS" in where else lines_with(text, where)[:1]
    )
    return in_line(text, k, lambda line: f"{what}\n{line}")


def new_option(text: str, random: Random) -> str:
    """An option that is not honoured."""
    more = {
        r"\*SOLID SECTION": ("COMPOSITE", "POISSON=0.4"),
        r"\*REBAR LAYER": ("GEOMETRY=LIFT EQUATION", "ORIENTATION=O"),
        r"\*SURFACE SECTION": ("DENSITY=1.0",),
        r"\*HYPERELASTIC": ("TEST DATA INPUT", "USER", "MARLOW", "VAN DER WAALS"),
        r"\*STATIC": ("STABILIZE", "RIKS"),
        r"\*STEP": ("PERTURBATION",),
        r"\*DSLOAD": ("FOLLOWER=NO", "AMPLITUDE=RAMP", "REGION TYPE=X"),
        r"\*ELASTIC": ("TYPE=ENGINEERING CONSTANTS", "COMPRESSION FACTOR=0"),
        r"\*VISCOELASTIC": ("NONLINEAR", "ERRTOL=0.1"),
        r"\*RIGID BODY": ("PIN NSET=RIM", "ANALYTICAL SURFACE=R"),
        r"\*NODE": ("SYSTEM=C",),
        r"\*DENSITY": ("DEPENDENCIES=1",),
    }
    pattern = random.choice(list(more))
    k = random.choice(lines_with(text, pattern + r"\s*(,|$)")[:2])
    return in_line(text, k, lambda line: f"{line.rstrip(', ')}, {random.choice(more[pattern])}")


def dangling(text: str, random: Random) -> str:
    """A set, surface or material that nobody has defined."""
    stop = lines_with(text, r"\*END STEP")[0]
    uses = r"\*(SOLID SECTION|SURFACE SECTION|RIGID BODY|EMBEDDED|NCOPY|ELCOPY|INSTANCE)"
    places = [k for k in lines_with(text, uses) if k < stop]
    data = [
        k + 1
        for k in lines_with(text, r"\*(SURFACE,|DSLOAD|BOUNDARY|EMBEDDED|NFILL|TIE)")
        if k < stop and re.match(r"[A-Z_]", text.splitlines()[k + 1].strip(), re.I)
    ]
    k = random.choice(places + data)

    def change(line: str) -> str:
        if not line.startswith("*"):
            first, comma, rest = line.partition(",")
            return f"{first.strip()}_X{comma}{rest}"
        head, *parts = line.split(",")
        values = [
            j
            for j, p in enumerate(parts)
            if re.search(r"(SET|NSET|MATERIAL|PART|NODE)\s*=", p, re.I) and "NEW" not in p.upper()
        ]
        j = random.choice(values)
        parts[j] = parts[j].rstrip().rstrip('"') + "_X"
        return ",".join([head, *parts])

    return in_line(text, k, change)


def folded(text: str, random: Random) -> str:
    """Two nodes of an element exchanged, or one that is not there, or twice."""
    places = []
    inside = False
    for k, line in enumerate(text.splitlines()):
        if line.startswith("*"):
            inside = bool(re.match(r"\*element.*cgax8", line, re.I))
        elif inside and line.count(",") == 8 and not line.startswith("**"):
            places.append(k)

    def change(line: str) -> str:
        fields = [field.strip() for field in line.split(",")]
        a, b = random.sample(range(1, 5), 2)
        what = random.randrange(3)
        if what == 0:
            fields[a], fields[b] = fields[b], fields[a]
        else:
            fields[a] = fields[b] if what == 1 else "999999"
        return ", ".join(fields)

    return in_line(text, random.choice(places), change)


def misplaced(text: str, random: Random) -> str:
    """A keyword of the model in the step, of a step or of a material in the model."""
    lines = text.splitlines()
    kind, before = random.choice(
        (
            (r"\*(HYPERELASTIC|DENSITY|VISCOELASTIC|ELASTIC)", r"\*NODE|\*PART"),
            (r"\*(DSLOAD|STATIC)", r"\*STEP"),
            (r"\*(SOLID SECTION|RIGID BODY|NSET|SURFACE)", r"\*END STEP"),
            (r"\*REBAR LAYER", r"\*SOLID SECTION"),
            (r"\*END STEP", r"\*STATIC"),
        )
    )
    k = random.choice(lines_with(text, kind)[:3])
    end = next((j for j in range(k + 1, len(lines)) if lines[j].startswith("*")), len(lines))
    moved, rest = lines[k:end], lines[:k] + lines[end:]
    at = lines_with("\n".join(rest), before)[0]
    return "\n".join(rest[:at] + moved + rest[at:]) + "\n"


KINDS: dict[str, Mutant] = {
    "misspelt keyword": keyword,
    "misspelt option": option,
    "unsupported keyword": unsupported,
    "unsupported option": new_option,
    "dangling name": dangling,
    "folded element": folded,
    "misplaced keyword": misplaced,
}


def judged(folder: Path, text: str, right: SolverDeck) -> str:
    """``refused`` by line, ``same``, or what is wrong."""
    path = folder / "tyre.inp"
    path.write_text(text, encoding="utf-8")
    try:
        deck = read_own_deck(path, "m").flat({})
        trial(deck)
    except OwnDeckError as error:
        return "refused" if error.place.line else "no line"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    is_same = deck.text == right.text and deck.pressure_Pa == right.pressure_Pa
    return "same" if is_same else "COMPUTED OTHERWISE"


def draw(count: int, seed: int) -> list[tuple[str, str, str, str]]:
    """Kind, style, judgement and text of each mutant."""
    random, results = Random(seed), list[tuple[str, str, str, str]]()
    styles = {"plain": own_decks.plain, **own_decks.STYLES}
    del styles["millimetres"], styles["free_format"]  # of the same words as others
    for name in ("lifted_membranes", "parts_of_cae"):
        styles[name] = lambda name=name: maker_decks.DECKS[name]()[f"{name}.inp"]
    styles["contact"] = lambda: own_decks.plain(
        own_decks.Tyre().mesh() + test_contact.rims() + test_contact.PAIRS,
        step=test_contact.MOUNT + own_decks.STEP,
    )
    with TemporaryDirectory() as folder:
        while len(results) < count:
            style = random.choice(list(styles))
            text = styles[style]()
            (Path(folder) / "right.inp").write_text(text)
            right = read_own_deck(Path(folder) / "right.inp", "m").flat({})
            kind = random.choice(list(KINDS))
            try:
                wrong = KINDS[kind](text, random)
            except (IndexError, ValueError):  # the style has nothing of the kind
                continue
            if wrong != text:
                results.append((kind, style, judged(Path(folder), wrong, right), wrong))
    return results


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args()
    results = draw(given.count, given.seed)
    print(Counter((kind, how) for kind, _, how, _ in results))
    for n, (kind, style, how, text) in enumerate(results):
        if how not in ("refused", "same"):
            print(n, kind, style, how)
        if given.keep and how != "refused":
            (given.keep / f"{n}_{style}_{how[:4]}.inp").write_text(text)


if __name__ == "__main__":
    main()
