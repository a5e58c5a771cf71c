"""All that the table admits of a user's deck changes the tyre, is refused, or is listed as quiet.

For each keyword and option that is honoured: in some deck that has it, without it, or with another
of its words, the flat deck is another one or is refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from tyrecal_solvers.language.rule import QUIET
from tyrecal_solvers.language.table import RULES

from tyrecal.tyre.own_deck.own_deck import OwnDeck, read_own_deck
from tyrecal.tyre.own_deck.text import Block, OwnDeckError

from . import own_decks, test_contact
from .test_membranes import maker


def changed(*edits: tuple[str, str]) -> str:
    """The plain deck, edited."""
    text = own_decks.plain()
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def law(words: str, data: str) -> str:
    """The plain deck with another law."""
    return changed(
        ("*HYPERELASTIC, MOONEY-RIVLIN, MODULI=LONG TERM", f"*HYPERELASTIC, {words}"),
        ("800000.0, 200000.0, 5e-08", data),
    )


EXTRA = {
    "membranes": maker(),
    "contact": own_decks.plain(
        own_decks.Tyre().mesh() + test_contact.rims() + test_contact.PAIRS,
        step=test_contact.MOUNT + own_decks.STEP,
    ),
    "amplitude": changed(
        (
            "*STEP",
            "*AMPLITUDE, NAME=RAMP, DEFINITION=TABULAR, TIME=STEP TIME\n0., 0., 1., 1.\n*STEP",
        ),
        ("*DSLOAD", "*DSLOAD, AMPLITUDE=RAMP, OP=NEW"),
        ("*BOUNDARY", "*BOUNDARY, AMPLITUDE=RAMP, OP=NEW"),
    ),
    "wrong amplitude": changed(
        ("*STEP", "*AMPLITUDE, NAME=OTHER\n0., 0., 1., 1.\n*STEP"),
        ("*BOUNDARY", "*BOUNDARY, AMPLITUDE=OTHER"),
    ),
    "yeoh": law("YEOH", "8e5, 1e4, 1e3, 5e-8"),
    "neo hooke": law("NEO HOOKE, MODULI=INSTANTANEOUS", "8e5, 5e-8"),
    "ogden": law("OGDEN, N=2", "2e6, 2.0, 1e5, -2.0, 5e-8"),
    "arruda": law("ARRUDA-BOYCE", "2e6, 3.0, 5e-8"),
    "reduced": law("REDUCED POLYNOMIAL, N=2", "8e5, 1e4, 5e-8, 5e-8"),
    "polynomial": law("POLYNOMIAL, N=2", "8e5, 2e5, 1e4, 1e4, 1e4, 5e-8"),
    "modulus table": changed(
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0.0, 0.1",
            "*VISCOELASTIC, FREQUENCY=TABULAR\n0.1, -0.1, 0., 0., 1.\n0.1, -0.2, 0., 0., 100.",
        ),
        ("*ELASTIC\n", "*ELASTIC, TYPE=ISOTROPIC, MODULI=LONG TERM\n"),
    ),
    "no compression": changed(("*DENSITY\n1500.0", "*NO COMPRESSION\n*DENSITY\n1500.0")),
    "controls": changed(
        (
            "MATERIAL=RUBBER",
            "MATERIAL=RUBBER, CONTROLS=HARD, ORIENTATION=O\n*HOURGLASS STIFFNESS\n3e4",
        ),
        (
            "*MATERIAL, NAME=RUBBER",
            "*SECTION CONTROLS, NAME=HARD, HOURGLASS=STIFFNESS\n"
            "*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR, DEFINITION=COORDINATES\n"
            "1., 0., 0., 0., 1., 0.\n*MATERIAL, NAME=RUBBER",
        ),
    ),
    "fanned": changed(
        (
            "*REBAR LAYER\nCARCASS, 4.2E-07, 0.001",
            "*REBAR LAYER, GEOMETRY=ANGULAR\nCARCASS, 4.2E-07, 0.3",
        )
    ),
    "sets": changed(
        ("*RIGID BODY", "*NSET, NSET=LINED, ELSET=LINER, UNSORTED\n*RIGID BODY"),
        ("*NODE, NSET=ALL\n", "*NODE, NSET=ALL, SYSTEM=R\n"),
        (
            "*ELSET, ELSET=LINER\n1\n2\n3\n",
            "*ELSET, ELSET=LINER, GENERATE\n1, 3\n*ELSET, ELSET=LINER\n",
        ),
    ),
    "pressed elements": changed(
        ("*DSLOAD\nCAVITY, P, 2.0E+05", "*DLOAD, OP=MOD, AMPLITUDE=RAMP\nLINER, P4, 2.0E+05"),
        ("*STEP", "*AMPLITUDE, NAME=RAMP\n0., 0., 1., 1.\n*STEP"),
    ),
    "system": changed(
        ("*NODE, NSET=ALL\n", "*SYSTEM\n1., 0., 0., 2., 0., 0.\n*SYSTEM\n*NODE, NSET=ALL\n")
    ),
    "moved system": changed(("*NODE\n900001", "*SYSTEM\n0.1, 0., 0., 1., 0., 0.\n*NODE\n900001")),
    "released": changed(
        ("*STEP", "*BOUNDARY\n1005, ENCASTRE\n*STEP"),
        ("*BOUNDARY\n900001", "*BOUNDARY, OP=NEW\n900001"),
    ),
    "held before": changed(("*STEP", "*BOUNDARY\n1005, ENCASTRE\n*STEP")),
    "unsorted": changed(
        (
            "*RIGID BODY",
            "*NSET, NSET=A, UNSORTED\n1003, 1001\n*NSET, NSET=B, UNSORTED\n2003, 2001\n"
            "*NFILL\nA, B, 1, 1000\n*RIGID BODY",
        )
    ),
    "filled": own_decks.generated().replace("*NFILL, NSET=ALL", "*NFILL, NSET=ALL, BIAS=1."),
    "embedded": own_decks.plain(own_decks.apart(9).mesh() + own_decks.EMBEDDED).replace(
        "HOST ELSET=SOLID",
        "HOST ELSET=SOLID, ROUNDOFF TOLERANCE=1e-6, EXTERIOR TOLERANCE=0.05, "
        "ABSOLUTE EXTERIOR TOLERANCE=0.001",
    ),
    "shifted": changed(
        (
            "*NODE\n900001",
            "*NSET, NSET=ONE\n1001\n*NCOPY, OLD SET=ONE, CHANGE NUMBER=500000, SHIFT, MULTIPLE=2, "
            "NEW SET=TWO\n0.1, 0., 0.\n*NODE\n900001",
        )
    ),
    "instance": own_decks.cae()
    .replace("part=Part-1\n*End", "part=Part-1, nset=Whole, elset=Body\n*End")
    .replace(
        "*Surface, type",
        "*Nset, nset=Some, instance=Part-1-1\n1001\n*Nset, nset=Again\nWhole\n"
        "*Elset, elset=Whole_again\nBody\n*Surface, type",
    ),
}


@cache
def decks() -> list[tuple[str, OwnDeck]]:
    """All decks with what they describe, in their units."""
    all_decks = []
    styles = {"plain": own_decks.plain, **own_decks.STYLES, "inner": own_decks.inner_ply}
    texts = {**{name: style() for name, style in styles.items()}, **EXTRA}
    with TemporaryDirectory() as folder:
        for name, text in texts.items():
            path = Path(folder) / "tyre.inp"
            path.write_text(text)
            deck = read_own_deck(path, "mm" if name == "millimetres" else "m")
            all_decks.append((described(deck), deck))
    return all_decks


def described(deck: OwnDeck) -> str:
    """The tyre that a deck describes, or that it is refused."""
    try:
        flat = deck.flat({})
    except OwnDeckError as error:
        return f"refused: {error.message}"
    model = flat.model
    state = flat.pressure_Pa, flat.long_term, model.reference, model.node_sets, model.cavity
    return f"{flat.text} {state} {flat.set_names} {flat.sections}"


def others(block: Block, option: str) -> Iterator[dict[str, str]]:
    """The parameters of a block without an option, then with its other words and values."""
    yield {key: value for key, value in block.parameters.items() if key != option}
    words = RULES[block.name].parameters[option]
    more = ["7", "ELSEWHERE"] if words.islower() else words.split("|")
    for value in more:
        if value != block.parameters[option]:
            yield {**block.parameters, option: value}


def admitted() -> list[tuple[str, str, str]]:
    """Place, keyword and option ("" for the keyword itself) of all that is honoured of a deck."""
    options_honoured = []
    for name, rule in RULES.items():
        for places, options in rule.honoured.items():
            for place in places.split("|"):
                if place.startswith("deck"):
                    each = [o.partition("=")[0] for o in options.split("; ") if o]
                    loud = [option for option in each if option[0] != QUIET]
                    if loud or not each:
                        options_honoured += [(place, name, option) for option in ("", *loud)]
    return options_honoured


@pytest.mark.parametrize(("place", "name", "option"), sorted(set(admitted())))
def test_what_is_admitted_changes_the_tyre_or_is_refused(
    place: str, name: str, option: str
) -> None:
    seen = False
    for whole, deck in decks():
        inside = False
        for k, block in enumerate(deck.blocks):
            inside = block.name == "STEP" or (inside and deck.blocks[k - 1].name != "END STEP")
            if block.name != name or inside != (place == "deck step"):
                continue
            if option and option not in block.parameters:
                continue
            seen = True
            if option:
                edits = [[replace(block, parameters=each)] for each in others(block, option)]
            else:
                edits = [[]]
            for new in edits:
                blocks = (*deck.blocks[:k], *new, *deck.blocks[k + 1 :])
                if described(OwnDeck(deck.path, deck.units, blocks, deck.texts)) != whole:
                    return
    assert seen, "no deck here has it"
    raise AssertionError("the tyre is the same without it, and with all its other words")
