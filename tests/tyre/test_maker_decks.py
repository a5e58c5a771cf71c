"""Decks in the manner of tyre makers' pre-processors are the same tyres written our way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.own import asked_by_abaqus
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case.kinds.section_deck import trial
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.text import OwnDeckError

from . import maker_decks
from .test_contact import with_lines
from .test_own_deck import write

QUICK = "included", "rim_in_contact"
CASES = [
    pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow])
    for name in maker_decks.DECKS
]


def recorded(name: str, folder: Path, soft: bool = False) -> str:
    """The deck's text; files that it includes are put into the folder, beads in contact held."""
    for path in maker_decks.FOLDER.glob(f"{name}*"):
        text = path.read_text(encoding="utf-8")
        (folder / path.name).write_text(maker_decks.softened(text) if soft else text)
    text = (folder / f"{name}.inp").read_text()
    try:
        read_own_deck(folder / f"{name}.inp").flat({})
    except OwnDeckError as error:
        return with_lines(text, str(error))
    return text


def mass_and_frequencies(folder: Path, text: str) -> np.ndarray:
    """kg, and Hz of all modes up to two waves."""
    loaded = load_case(write(folder, text), allow_unusual=True)
    analysis = loaded.case.analysis.model_copy(update={"highest_harmonic": 2})
    object.__setattr__(loaded, "case", loaded.case.model_copy(update={"analysis": analysis}))
    answer = Evaluator(TyreDesign(loaded)).evaluate(Question({}))
    return np.array([answer.mass_kg, *(mode.frequency_Hz for mode in answer.modes)])


@pytest.mark.parametrize("name", maker_decks.DECKS)
def test_the_files_are_those_that_the_program_writes(name: str) -> None:
    """And ABAQUS' manual takes all of it."""
    for file, text in maker_decks.DECKS[name]().items():
        assert (maker_decks.FOLDER / file).read_text(encoding="utf-8") == text
    deck = read_own_deck(maker_decks.FOLDER / f"{name}.inp")
    assert asked_by_abaqus(deck.with_numbers({})) == {"refuses": [], "unknown": []}


@pytest.mark.parametrize("name", CASES)
def test_with_soft_membranes_it_is_the_same_tyre(name: str, tmp_path: Path) -> None:
    """Within 0.1 %; with the compound as stiff as it is some mode moves by more than that."""
    ours = mass_and_frequencies(tmp_path, maker_decks.OUR_WAY[name])
    soft = mass_and_frequencies(tmp_path, recorded(name, tmp_path, soft=True))
    np.testing.assert_allclose(soft, ours, rtol=1e-3)
    if name not in QUICK:
        whole = mass_and_frequencies(tmp_path, recorded(name, tmp_path))
        assert whole[0] == pytest.approx(ours[0], rel=1e-6)
        assert 0.01 < (whole / ours - 1).max() < 0.05


@pytest.mark.parametrize(
    "law",
    [
        "*HYPERELASTIC, MARLOW\n*UNIAXIAL TEST DATA\n 0., 0.\n 1.0E8, 0.05",
        "*HYPERELASTIC, N=2, TEST DATA INPUT\n*UNIAXIAL TEST DATA\n 1.0E8, 0.05",
        "*USER MATERIAL, CONSTANTS=3\n 4.0E9, 4.0E7, -0.001",
        "*HYPERELASTIC, NEO HOOKE\n 6.0E8",
    ],
)
def test_cords_are_elastic_or_refused_with_what_to_give(law: str, tmp_path: Path) -> None:
    text = maker_decks.lifted_membranes()["lifted_membranes.inp"]
    path = tmp_path / "tyre.inp"
    path.write_text(text.replace("*ELASTIC\n4e+09, 0.3", law))
    with pytest.raises(OwnDeckError, match=r"line \d+: .*(cord.*\*ELASTIC|\*ELASTIC.*cord)"):
        trial(read_own_deck(path).flat({}))
