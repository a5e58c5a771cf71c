"""All that the table admits of a user's deck acts, is refused or is listed, in every spelling."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from tyrecal_solvers.language.rule import QUIET
from tyrecal_solvers.language.spelling import full_keyword, named
from tyrecal_solvers.language.table import RULES

from tyrecal.simulate.deck.own import asked_by_abaqus
from tyrecal.tyre.own_deck.own_deck import OwnDeck, read_own_deck
from tyrecal.tyre.own_deck.text import Block, OwnDeckError

from ..studies import spellings
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


# (text of the plain deck, the same in another legal spelling)
SPELLINGS = (
    ("REF NODE=", "REFNODE="),
    ("*END STEP", "*ENDSTEP"),
    ("*END STEP", "* E N D st"),
    ("*VISCOELASTIC", "*VISCOEL"),
    ("*MATERIAL", "*MATER"),
    ("MATERIAL=RUBBER", "MAT = Rub ber"),
    ("MATERIAL=RUBBER", 'MAT="rubber"'),
    ("MOONEY-RIVLIN", "MOONEY"),
    ("MODULI=LONG TERM", "MOD=LONG"),
    ("*REBAR LAYER", "*REBARLAYER"),
    ("*SURFACE SECTION", "*SURFACESEC"),
    ("*STATIC, LONG TERM", "*STAT, LONGTERM"),
    ("NLGEOM=YES", "NLG=Y"),
    ("TIME=PRONY", "TIM=PRON"),
    ("*ELASTIC", "*ELAS, TYPE=ISO"),
    ("TYPE=ELEMENT", "TYPE=ELEM"),
    ("*BOUNDARY", "*BOUN"),
    ("0.3, 0.0, 0.1", "0.3, , 1.D-1,"),
    ("1, 1001, 3001", "1, 1001 ,\n3001"),
    ("3002, 2003, 1002\n", "3002, 2003, 1002,\n"),
    ("*ELSET, ELSET=LINER\n", "*ELSET, ELSET=LINER, GEN\n1, 99\n*ELSET, ELSET=OTHER\n"),
    ("900001, 0.0, 0.0", "900001,"),
)


def flat_text(folder: Path, text: str) -> str:
    """The flat deck, of which ABAQUS refuses nothing."""
    (folder / "tyre.inp").write_text(text)
    deck = read_own_deck(folder / "tyre.inp")
    assert not asked_by_abaqus(deck.blocks)["refuses"]
    return deck.flat({}).text


@pytest.fixture(scope="module")
def plain_flat(tmp_path_factory: pytest.TempPathFactory) -> str:
    return flat_text(tmp_path_factory.mktemp("plain"), own_decks.plain())


@pytest.mark.parametrize(("full", "short"), SPELLINGS)
def test_a_legal_spelling_is_the_same_deck(
    full: str, short: str, plain_flat: str, tmp_path: Path
) -> None:
    text = own_decks.plain()
    assert full in text
    flat = flat_text(tmp_path, text.replace(full, short))
    assert flat.replace(", TYPE=ISOTROPIC", "").replace("0.3, , 1.D-1, ", "0.3, 0.0, 0.1") == (
        plain_flat
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("*ELASTIC", "*ELA, TYP=L", "TYPE=LAMINA is not honoured, only ISOTROPIC"),
        ("*DENSITY", "*DE", r"'DE' may be .*\*DEBOND or .*\*DENSITY"),
        ("TIE NSET=RIM", "P=RIM", "'P' may be PIN NSET or POSITION"),
        ("*END STEP\n", "*END STEP\n*NSET, NSET=X\n1001\n", "is after a step"),
        ("*END STEP\n", "*END STEP\n1., 2.\n", "takes no data lines"),
        ("*END STEP\n", "*END STEP\n*STEP\n", "no \\*END STEP"),
        ("1100.0", "1_100.0", "'1_100.0' is not a number"),
        ("LINER, S4", "LINER, S4" + 9999 * " ,", "more than 4096 characters"),
        ("*ELSET, ELSET=LINER\n", "*ELSET, ELSET=LINER, GEN\n1000000000, 2000000000\n", "no elem"),
        ("*NODE, NSET=ALL\n", "*NODE, NSET=ALL\n-5, 0.3, 0.0\n", "node -5: numbers go from 1"),
        ("*ELSET, ELSET=LINER\n", "*ELSET, ELSET=X\n²\n*ELSET, ELSET=LINER\n", "set ² is not"),
        ("*MATERIAL", "*PARAMETER\nA = " + 4000 * "-" + "1\n*MATERIAL", "nested too deep"),
        ("*ELSET, ELSET=LINER\n", 20_000 * "*ELSET, ELSET=X\n1\n", "20000 keywords"),
    ],
)
def test_what_no_rule_allows_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "tyre.inp"
    path.write_text(own_decks.plain().replace(old, new, 1))
    with pytest.raises(OwnDeckError, match=r"^tyre.inp, line \d+: .*" + words):
        read_own_deck(path).flat({})


def test_an_exact_word_is_no_abbreviation() -> None:
    assert full_keyword("visco") == "VISCO" and full_keyword("viscoe") == "VISCOELASTIC"
    assert full_keyword("Rebar") == "REBAR" and full_keyword("SHEARTESTDATA") == "SHEAR TEST DATA"
    assert full_keyword("nothing like it") == "NOTHING LIKE IT"
    assert named(' "Rubber  A" ') == "RUBBER A" and named("Rubber A") == "RUBBERA"
    with pytest.raises(ValueError, match=r"may be \*SURFACE or \*SURFACE BEHAVIOR"):
        full_keyword("SURF")


def test_sets_of_an_instance(tmp_path: Path) -> None:
    """All its nodes, and all its elements, from outside it."""
    text = own_decks.cae().replace("part=Part-1\n", "part=Part-1, nset=Whole, elset=Body\n")
    (tmp_path / "tyre.inp").write_text(text)
    sets = read_own_deck(tmp_path / "tyre.inp").flat({}).model.node_sets
    assert len(sets["WHOLE"]) == len(own_decks.Tyre().nodes)


def test_spellings_drawn_from_the_rules_are_the_same_tyre(request: pytest.FixtureRequest) -> None:
    assert not spellings.draw(5, request.config.getoption("--seed"))
