"""Numbers of user decks times 10, 100, 1000 and their inverses: refused, or the same tyre?

    python -m tests.studies.deck_numbers [DECK ...] > numbers.jsonl
    python -m tests.studies.deck_numbers numbers.jsonl

Each number of a deck that is no label is exchanged for its slip: all of materials, layers, sections
and steps, and `NODES` coordinates. Printed is one line of JSON for each: ``refused`` (the sentence,
"" if there is none), ``moves``, the largest relative change of the mass and of a frequency of up to
two waves (null if they were not computed), and ``failed``, why they were not.
The second command counts a record, and lists the slips that move an answer by more than 20 % and
are not refused.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Container, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tyrecal.errors import InputError
from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.tyre.case import with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.numbers import assigned, plain_number
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.text import Block, Row

from ..tyre import own_decks, test_membranes
from ..tyre.test_own_deck import write

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
FACTORS = 10.0, 100.0, 1000.0, 0.1, 0.01, 0.001
LARGE = 0.2  # change of an answer that a number must not make in silence
NODES = 6  # coordinates of each deck, evenly spaced among all
Trial = dict[str, Any]
LABELS = {"NSET", "ELSET", "ELEMENT", "ELGEN", "ELCOPY", "SURFACE", "HEADING", "TIE", "OUTPUT"}
LABELS |= {"NODE OUTPUT", "EMBEDDED ELEMENT", "BOUNDARY"}
MAKERS = "included", "half_section", "lifted_membranes", "rim_in_contact"


def with_law(words: str, constants: str) -> str:
    """The plain deck with another law of its rubber."""
    law = "*HYPERELASTIC, MOONEY-RIVLIN, MODULI=LONG TERM\n800000.0, 200000.0, 5e-08"
    text = own_decks.plain()
    assert law in text
    return text.replace(law, f"*HYPERELASTIC, {words}\n{constants}")


def written() -> str:
    """The deck of `cases/p235_75r17.yaml`, as tyrecal writes it."""
    design = TyreDesign(with_level(load_case(CASE), "coarse"))
    return design.texts("abaqus", Decks(design).request)["inflate.inp"]


DECKS: dict[str, Callable[[], str]] = {
    "plain": own_decks.plain,
    "millimetres": own_decks.millimetres,
    "cae": own_decks.cae,
    "compounds": own_decks.compounds,
    "parameters": own_decks.parameters,
    "ogden": lambda: with_law("OGDEN, N=2", "1.8e6, 2.0, 2.0e5, -2.0, 5e-8, 0.0"),
    "arruda": lambda: with_law("ARRUDA-BOYCE", "2.0e6, 3.0, 5e-8"),
    "written": written,
}


def decks(folder: Path, name: str) -> Path:
    """Write a deck with all of its files; returns the path of the first."""
    path = folder / f"{name}.inp"
    path.write_text(DECKS[name]() if name in DECKS else test_membranes.recorded(name, folder))
    return path


def places(path: Path) -> Iterator[tuple[str, int, int, str]]:
    """File, line, field and words of each number that may slip; field -1: NAME = value."""
    coordinates = []
    for block in read_own_deck(path).blocks:
        for row in block.rows if block.name not in LABELS else ():
            for j, text in numbers(block, row):
                place = row.place.file, row.place.line, j, f"*{block.name} {row.text(0)}, {j + 1}"
                if block.name == "NODE":
                    coordinates.append(place)
                elif text:
                    yield place
    yield from coordinates[:: max(1, len(coordinates) // NODES)][:NODES]


def numbers(block: Block, row: Row) -> Iterator[tuple[int, str]]:
    """Fields of a data line that are numbers other than 0, and no labels."""
    if block.name == "PARAMETER":
        value = assigned(row)[1]
        yield from [(-1, value)] if plain_number(value) else []
        return
    for j, text in enumerate(row.fields):
        is_label = block.name in ("NODE", "REBAR LAYER", "REBAR", "DSLOAD") and j == 0
        if plain_number(text) and row.number(j) and not is_label:
            yield j, text


def slipped(text: str, line: int, field: int, factor: float) -> str:
    """The text of a file with one number times a factor."""
    lines = text.split("\n")
    separator = "=" if field < 0 else ","
    parts = lines[line - 1].split(separator)
    value = float(parts[field].partition("#")[0]) * factor
    parts[field] = f" {value:.9g}"
    lines[line - 1] = separator.join(parts)
    return "\n".join(lines)


def answers(path: Path) -> np.ndarray:
    """kg, and the lowest frequencies, Hz. Raises InputError, EvaluationFailed."""
    loaded = load_case(write(path.parent, path.read_text()))
    analysis = loaded.case.analysis.model_copy(update={"highest_harmonic": 2})
    object.__setattr__(loaded, "case", loaded.case.model_copy(update={"analysis": analysis}))
    answer = Evaluator(TyreDesign(loaded)).evaluate(Question({}))
    hertz = sorted(mode.frequency_Hz for mode in answer.modes)
    return np.array([answer.mass_kg, *hertz])


def trials(name: str, path: Path, chosen: Container[int] = range(10**6)) -> Iterator[Trial]:
    """Each slip of a deck, or those of the ``chosen`` places in their list, and how it ends."""
    right = answers(path)
    slips = [(*place, factor) for place in places(path) for factor in FACTORS]
    for k, (file, line, field, words, factor) in enumerate(slips):
        if k not in chosen:
            continue
        target, refused, failed, moves = path.with_name(file), "", "", None
        text = target.read_text()
        target.write_text(slipped(text, line, field, factor))
        try:
            moves = float(abs(answers(path) / right - 1).max())
        except EvaluationFailed as error:
            failed = str(error)
        except InputError as error:
            refused = str(error)
        target.write_text(text)
        yield {
            "deck": name,
            "number": f"{words}, {file}:{line}",
            "factor": factor,
            "refused": refused[:300],
            "moves": moves,
            "failed": failed[:200],
        }


def is_silent(trial: Trial) -> bool:
    """Whether an answer is far off, and nothing was reported."""
    return not trial["refused"] and not trial["failed"] and trial["moves"] > LARGE


def ending(trial: Trial) -> str:
    """One word for how a trial ended."""
    if is_silent(trial):
        return "silent"
    return "refused" if trial["refused"] else "failed" if trial["failed"] else "same"


def main() -> None:
    if sys.argv[1:] and sys.argv[1].endswith(".jsonl"):
        record = [json.loads(line) for line in Path(sys.argv[1]).read_text().splitlines()]
        for deck in dict.fromkeys(each["deck"] for each in record):
            counts = Counter(ending(each) for each in record if each["deck"] == deck)
            print(f"{deck}: {counts.total()} slips, {dict(counts)}")
        for each in filter(is_silent, record):
            print(f"{each['deck']} {each['number']} x {each['factor']:g}: {each['moves']:.2g}")
        return
    for name in sys.argv[1:] or (*DECKS, *MAKERS):
        with TemporaryDirectory() as folder:
            for trial in trials(name, decks(Path(folder), name)):
                print(json.dumps(trial), flush=True)


if __name__ == "__main__":
    main()
