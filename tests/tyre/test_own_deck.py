"""A deck in any style is the tyre that it describes; what is not understood is refused by line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.own import trial
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import start_values
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.text import OwnDeckError
from tyrecal.tyre.values import with_values

from . import own_decks

MM = {"millimetres"}


def write(folder: Path, text: str) -> Path:
    """The deck, and its case beside it."""
    path = folder / "tyre.inp"
    path.write_text(text, encoding="utf-8")
    deck = read_own_deck(path)
    case = path.with_suffix(".yaml")
    case.write_text(own_case(deck, deck.flat({}), "not given", None), encoding="utf-8")
    return case


def frequencies(case: Path) -> np.ndarray:
    """Of the tyre's first modes, and its mass."""
    loaded = load_case(case)
    analysis = loaded.case.analysis.model_copy(update={"highest_harmonic": 2})
    plain = loaded.case.model_copy(update={"analysis": analysis})
    object.__setattr__(loaded, "case", plain)
    found = Evaluator(TyreDesign(loaded)).evaluate(Question({}))
    return np.array([found.mass_kg, *(mode.frequency_Hz for mode in found.modes)])


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    return frequencies(write(tmp_path_factory.mktemp("plain"), own_decks.plain()))


@pytest.mark.parametrize("style", own_decks.STYLES)
def test_only_the_writing_differs(style: str, reference: np.ndarray, tmp_path: Path) -> None:
    found = frequencies(write(tmp_path, own_decks.STYLES[style]()))
    assert found == pytest.approx(reference, rel=1e-9)


def test_included_files(reference: np.ndarray, tmp_path: Path) -> None:
    text = own_decks.plain()
    at = text.index("*SOLID SECTION")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mesh.inp").write_text(text[:at])
    found = frequencies(write(tmp_path, "*include, Input=parts/mesh.inp\n" + text[at:]))
    assert found == pytest.approx(reference, rel=1e-12)
    (tmp_path / "parts" / "mesh.inp").write_text(text[:at] + "*NOD\n")
    with pytest.raises(OwnDeckError, match=r"^parts/mesh.inp, line \d+: \*NOD: .*\*NODE"):
        read_own_deck(tmp_path / "tyre.inp").flat({})


def test_a_ply_on_the_inner_surface(tmp_path: Path) -> None:
    """The pressure on its face is that on the rubber's."""
    texts = own_decks.inner_ply(), own_decks.inner_ply(spelled=True)
    flats = []
    for text in texts:
        (tmp_path / "tyre.inp").write_text(text)
        flats.append(read_own_deck(tmp_path / "tyre.inp").flat({}))
    assert flats[0].text == flats[1].text


def test_marks_and_paths_have_exact_slopes(tmp_path: Path) -> None:
    """A mark in the text, a path, a parameter: the same number, the same slope; and that slope is
    the frequencies'."""
    case = write(tmp_path, own_decks.parameters())
    deck = tmp_path / "tyre.inp"
    deck.write_text(deck.read_text().replace("<c01>", "{{ second }}"))
    text = case.read_text()
    text = text[: text.index("variables:")] + text[text.index("# What was measured") :]
    text += (
        "variables:\n"
        "  area: {sets: [parameter / AREA], start: 2.1e-7, lower: 1.0e-7, upper: 1.0e-6}\n"
        "  second: {sets: [deck.numbers.second], start: 2.0e5, lower: 1.0e5, upper: 1.0e6}\n"
        "  E: {sets: [material cord/elastic/e], start: 1.0e10, lower: 1.0e9, upper: 1.0e11}\n"
    )
    case.write_text(text)
    loaded = load_case(case)
    start = start_values(loaded)
    evaluator = Evaluator(TyreDesign(with_values(loaded, start)))
    hertz = lambda values: np.array(
        [m.frequency_Hz for m in evaluator.evaluate(Question(values)).modes]
    )
    slopes = evaluator.evaluate(Question(start, tuple(start))).gradients
    for name, value in start.items():
        h = 1e-4 * value
        up, down = (hertz({**start, name: value + side * h}) for side in (1, -1))
        assert slopes[name] == pytest.approx((up - down) / (2 * h), rel=1e-5, abs=1e-6 / value)


REFUSED = {
    "SOLID SECTION, ELSET=SOLID": (
        "SOLID SECTION, ELSET=SOLIDS",
        "element set SOLIDS is not defined",
    ),
    "*HYPERELASTIC": ("*HYPERELASTICS", "did you mean \\*HYPERELASTIC"),
    "MODULI=LONG TERM": ("MODULUS=LONG TERM", "did you mean MODULI"),
    "*DENSITY\n1100.0": ("", "needs a \\*DENSITY"),
    "NLGEOM=YES": ("NLGEOM=NO", "only YES or no value"),
    "900001, 1, 6": ("900001, 1, 2", "1, 2 and 6"),
    "CAVITY, P, 2.0E+05": ("CAVITY, HP, 2.0E+05", "only P"),
    "LINER, S4": ("LINER, S1", "no free surface"),
    "*REBAR LAYER\nCARCASS, 4.2E-07, 0.001, 0.0,": (
        "*REBAR LAYER\nCARCASS, 4.2E-07, 0.001, 0.1,",
        "position",
    ),
    "*END STEP": ("", "cut off"),
    "TYPE=CGAX8R": ("TYPE=CPS8R", "no element of a revolved tyre"),
}


@pytest.mark.parametrize("text", REFUSED)
def test_refused_by_line(text: str, tmp_path: Path) -> None:
    other, words = REFUSED[text]
    path = tmp_path / "tyre.inp"
    whole = own_decks.plain()
    assert whole.count(text) >= 1
    path.write_text(whole.replace(text, other, 1))
    with pytest.raises(OwnDeckError, match=r"^tyre.inp, line \d+: .*" + words):
        trial(read_own_deck(path).flat({}))
