"""A case of a user's deck: what it may leave out, marks, and all of its mistakes at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from tyrecal.tyre.load import load_case, validate

from ..cli.test_cli import run
from . import own_decks

MARKED = own_decks.plain().replace("2.1e-7", "{{ A_belt }}").replace("800000.0", "{{ C10 }}")


@pytest.fixture
def deck(tmp_path: Path) -> Path:
    path = tmp_path / "tyre.inp"
    path.write_text(own_decks.plain(), encoding="utf-8")
    (tmp_path / "marked.inp").write_text(MARKED, encoding="utf-8")
    return path


def test_a_case_needs_no_more_than_its_deck(deck: Path, capsys: pytest.CaptureFixture[str]) -> None:
    short, whole = deck.with_name("short.yaml"), deck.with_name("whole.yaml")
    short.write_text("format: 1\ndeck: {file: tyre.inp}\n", encoding="utf-8")
    assert run("validate", str(short)) == 0
    lines = capsys.readouterr().err.partition("lines that are left out:\n")[2].split("\n")[:7]
    assert "analysis: {static_moduli: long_term}" in lines
    assert "pressure_kPa: 200" in lines
    whole.write_text(
        "\n".join(["format: 1", *lines]).replace("{units: m}", "{file: tyre.inp, units: m}"),
        encoding="utf-8",
    )
    assert load_case(whole).case == load_case(short).case
    assert not load_case(whole).assumed


def test_all_mistakes_of_a_case_of_a_deck_are_reported_at_once(deck: Path) -> None:
    case = deck.with_name("wrong.yaml")
    case.write_text(
        "format: 1\n"
        "deck: {file: marked.inp, units: cm, numbers: {A_blet: 1}}\n"
        "rim: {mass: 3}\n"
        "variables: {x: {sets: [material RUBBER / DENSITY / rho], start: 1, lower: 3, upper: 4}}\n",
        encoding="utf-8",
    )
    keys = {mistake.key or mistake.value for mistake in validate(case)}
    assert keys == {
        "deck.units",
        "deck.numbers.A_blet",
        "{{ A_belt }}",
        "{{ C10 }}",
        "rim.mass",
        "variables.x.start",
        "variables.x.sets.0",
    }


def test_a_deck_that_is_refused_hides_no_mistake_of_its_case(deck: Path) -> None:
    deck.write_text(own_decks.plain().replace("*HYPERELASTIC, MOONEY", "*HYPERELASTIC, MARLOW"))
    case = deck.with_name("wrong.yaml")
    case.write_text("format: 1\ndeck: {file: tyre.inp}\nrim: {mass: 3}\n", encoding="utf-8")
    assert {mistake.key for mistake in validate(case)} == {"", "rim.mass"}


def test_init_takes_marks(deck: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["init", "--deck", str(deck.with_name("marked.inp")), "--no-pictures"]
    assert run(*command) == 2
    words = capsys.readouterr().err
    assert "{{ A_belt }} (marked.inp, line " in words
    assert words.endswith("give each: --set A_belt=VALUE --set C10=VALUE\n")
    assert run(*command, "--set", "C10=8e5", "--set", "A_belt=2.1e-7") == 0
    case = load_case(deck.with_name("marked.yaml")).case
    assert case.deck
    assert case.deck.numbers["A_belt"] == case.variables["A_belt"].start == 2.1e-7
    assert case.variables["C10"].sets == ["deck.numbers.C10"]
    assert run(*command, "--set", "C01=8e5", "--force") == 2


def test_decks_whose_files_cannot_name_jobs_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("inflate one.inp", "modes.inp"):
        (tmp_path / name).write_text(own_decks.plain())
    decks = (word for name in ("inflate one.inp", "modes.inp") for word in ("--deck", name))
    command = ("--deck" if word == "--deck" else str(tmp_path / word) for word in decks)
    assert run("init", *command, "--no-pictures") == 2
    assert "'inflate one.inp' must be FILE.inp" in capsys.readouterr().err
