"""A deck in the spellings that the manual allows is the deck that it spells."""

from __future__ import annotations

from pathlib import Path

import pytest
from tyrecal_solvers.language.spelling import full_keyword, named

from tyrecal.simulate.deck.own import asked_by_abaqus
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.text import OwnDeckError

from ..studies import spellings
from . import own_decks

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
