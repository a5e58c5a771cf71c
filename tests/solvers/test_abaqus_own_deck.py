"""A user's own deck on ABAQUS, played by a stand-in that reads the text as it is given."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.language.text import read_keywords

from tyrecal.simulate.deck.decks import Decks, without_header
from tyrecal.simulate.deck.tyre_design import OWN_TEXT, TyreDesign
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.templates import TemplateFailed
from tyrecal.tyre.values import with_values

from ..cli.test_cli import run
from ..tyre import own_decks

STANDIN = Path(__file__).with_name("standin_own_deck.py")
RESTART = "*RESTART, WRITE\n"
MIDDLE = range(own_decks.BELT[0], own_decks.BELT[1] + 1, 2)
CROWN = "*NSET, NSET=CROWN\n" + "".join(f"{own_decks.number(4, j)},\n" for j in MIDDLE)


def case_of(folder: Path, text: str) -> Path:
    """A case of a deck that ABAQUS could revolve."""
    path = folder / "tyre.inp"
    path.write_text(text.replace("*SOLID SECTION", f"{RESTART}{CROWN}*SOLID SECTION", 1))
    deck = read_own_deck(path)
    case = folder / "tyre.yaml"
    case.write_text(own_case(deck, deck.flat({}), "P235/75R17", None))
    return case


@pytest.mark.slow
@pytest.mark.parametrize("style", [own_decks.plain, own_decks.millimetres])
def test_modes_are_those_of_the_bundled_solver(
    style: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The deck is in m or mm, with a number set by a path and another pressure."""
    case = case_of(tmp_path, style())  # type: ignore[operator]
    name = next(iter(load_case(case).case.variables))
    value = 1.2 * load_case(case).case.variables[name].start
    given = ("--set", f"{name}={value!r}", "--pressure-kPa", "180", "--json", "--no-store")
    command = ("--solver", "abaqus", "--solver-command", f"{sys.executable} {STANDIN}")
    results = []
    for folder, more in (("a", command), ("b", ())):
        assert run("modes", str(case), *given, *more, "--output", str(tmp_path / folder)) == 0
        results.append(json.loads(capsys.readouterr().out))
    ours, theirs = results
    assert ours["mass_kg"] == pytest.approx(theirs["mass_kg"], rel=1e-5)
    label = lambda mode: (mode["c"], mode["m"], mode["kind"])
    hertz = {label(mode): mode["frequency_Hz"] for mode in ours["modes"]}
    same = [m for m in theirs["modes"] if label(m) in hertz]
    assert len(same) >= 6
    for mode in same:
        assert hertz[label(mode)] == pytest.approx(mode["frequency_Hz"], rel=1e-6)


def test_the_text_is_the_users_but_for_the_marks(tmp_path: Path) -> None:
    """Every line, comments and blanks among them, and what it includes; the grammar takes both."""
    mesh, rest = own_decks.plain().split("*SOLID SECTION", 1)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mesh.inp").write_text(mesh + RESTART + CROWN)
    text = "** mine\n*INCLUDE, INPUT=parts/mesh.inp\n*SOLID SECTION" + rest.replace(
        "BELT_2, 2.1e-7", "BELT_2 ,  {{ A_belt }}"
    )
    (tmp_path / "tyre.inp").write_text(text)
    deck = read_own_deck(tmp_path / "tyre.inp")
    content = own_case(deck, deck.flat({"A_belt": 2.1e-7}), "P235/75R17", None)
    (tmp_path / "tyre.yaml").write_text(content.replace("numbers: {}", "numbers: {A_belt: 2.1e-7}"))
    case = load_case(tmp_path / "tyre.yaml")

    def written(values: dict[str, float]) -> dict[str, str]:
        texts = Decks(TyreDesign(with_values(case, values))).texts(OWN_TEXT)
        return {file: without_header(text.encode()).decode() for file, text in texts.items()}

    plain = written({})
    assert plain["inflate.inp"] == text.replace("{{ A_belt }}", "2.1e-07")
    assert plain["parts/mesh.inp"] == mesh + RESTART + CROWN
    first = read_keywords(plain["parts/mesh.inp"] + plain["inflate.inp"].split("mesh.inp\n")[1])
    assert not [finding for finding in findings(first) if finding.sure]
    assert not findings(read_keywords(plain["modes.inp"]), first)
    other = written({"deck.numbers.A_belt": 3e-7, "material RUBBER / HYPERELASTIC / C10": 9e5})
    lines = zip(plain["inflate.inp"].splitlines(), other["inflate.inp"].splitlines(), strict=True)
    assert [pair for pair in lines if pair[0] != pair[1]] == [
        (
            "BELT_2 ,  2.1e-07, 1.16e-3, 0.0, CORD, 110.0",
            "BELT_2 ,  3e-07, 1.16e-3, 0.0, CORD, 110.0",
        ),
        ("800000.0, 200000.0, 5e-08", "900000, 200000.0, 5e-08"),
    ]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (RESTART, "", "put .RESTART, WRITE into the deck"),
        ("NSET=CROWN", "NSET=TOP", "no node set CROWN: .* deck.crown"),
        ("*STATIC, LONG TERM", "*STATIC", "static_moduli must be those"),
        (
            "*END STEP",
            "*END STEP\n*STEP\n*STATIC\n*USER SUBROUTINE\n*END STEP",
            "leads out of the run's folder",
        ),
    ],
)
def test_what_abaqus_would_not_revolve(tmp_path: Path, old: str, new: str, words: str) -> None:
    case = case_of(tmp_path, own_decks.plain())
    path = tmp_path / "tyre.inp"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(TemplateFailed, match=words):
        Decks(TyreDesign(load_case(case))).texts(OWN_TEXT)


def test_parts_are_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "tyre.inp").write_text(own_decks.cae())
    deck = read_own_deck(tmp_path / "tyre.inp")
    (tmp_path / "tyre.yaml").write_text(own_case(deck, deck.flat({}), "P235/75R17", None))
    with pytest.raises(TemplateFailed, match="Do not use parts and assemblies"):
        Decks(TyreDesign(load_case(tmp_path / "tyre.yaml"))).texts(OWN_TEXT)
