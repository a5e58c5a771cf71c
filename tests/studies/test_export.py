"""The calibrated tyre as files: run again they have the fit's frequencies, and only numbers differ
from what the user wrote."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from tyrecal.simulate.deck.decks_design import design_of
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.studies.fitted import as_fitted
from tyrecal.tyre.case import start_values
from tyrecal.tyre.case.edit_text import set_in_text
from tyrecal.tyre.case.editor import SCHEMA_FILE
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.case.mistakes import Keys
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.values import overridden

from ..cli.test_cli import run
from ..conftest import CASES
from ..solved import solved_once as solved_once
from ..tyre import own_decks

NUMBER = re.compile(r"(?<![\w.])[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?(?!\w)")
MARK = re.compile(r"\{\{ *\w+ *\}\}")


def numbers_apart(text: str) -> list[str]:
    """Lines with a # for each number or mark: what a user wrote besides them."""
    return NUMBER.sub("#", MARK.sub("1", text)).split("\n")


def with_fit(case: Path, factor: float, overrides: dict[str, Any], mesh: str) -> Path:
    """A folder with the fit.json of a fit that moved all variables by a factor."""
    loaded = load_case(case)
    folder = case.parent / "results"
    folder.mkdir()
    of_tyre = tyre_sha256(overridden(loaded, overrides))
    fit = {
        "variables": {n: {"value": factor * x} for n, x in start_values(loaded).items()},
        "fixed": {},
        "converged": True,
        "moved": True,
        "pressure_kPa": loaded.case.pressure_kPa,
        "provenance": {"tyre_sha256": of_tyre, "mesh": mesh, "overrides": overrides},
    }
    (folder / "fit.json").write_text(json.dumps(fit))
    return folder / "fit.json"


def frequencies(case: Path, fit: Path | None = None) -> list[float]:
    """Mass and frequencies of a case of few harmonics, as its file has it or as a fit left it."""
    loaded = load_case(case)
    loaded = as_fitted(fit, loaded) if fit else loaded
    analysis = loaded.case.analysis.model_copy(update={"highest_harmonic": 0})
    object.__setattr__(loaded, "case", loaded.case.model_copy(update={"analysis": analysis}))
    answer = Evaluator(design_of(loaded, start_values(loaded))).evaluate(Question({}))
    return [answer.mass_kg, *(round(mode.frequency_Hz, 6) for mode in answer.modes)]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["p235_75r17", "205_60r15"])
def test_a_case_as_fitted(name: str, tmp_path: Path) -> None:
    """Its own text, from another folder: a number that the fit's command set is in it, too."""
    for path in CASES.glob(f"{name}*"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    case = tmp_path / f"{name}.yaml"
    fit = with_fit(case, 1.1, {"rim.mass_kg": 7.5, "effects.bead_filler": 0.5}, "coarse")
    assert run("export", str(fit.parent), "--case", str(case)) == 0
    new = fit.parent / "export" / f"{name}_fitted.yaml"
    assert frequencies(new) == frequencies(case, fit)
    assert load_case(new).case.rim.mass_kg == 7.5
    old_lines, lines = (numbers_apart(path.read_text()) for path in (case, new))
    added = [line for line in lines if line not in old_lines]
    added = [words for line in added if (words := line.partition("  # ")[0].strip())]
    assert added.pop(0) == f"# yaml-language-server: $schema={SCHEMA_FILE}"
    assert {*added} - {"effects:"} == {"level: coarse", "mass_kg: #", "bead_filler: #"}
    gone = [line.partition("  # ")[0].strip() for line in old_lines if line not in lines]
    assert gone == ["level: default"]


def deck_of(name: str, folder: Path) -> Path:
    """A deck of a style, in Latin-1 with the line ends of Windows; its case beside it."""
    text = own_decks.STYLES[name]().replace("a tyre", "ein Gürtelreifen")
    if name == "millimetres":
        text = text.replace("0.8, 0.2", "{{ C10 }}, 0.2")
        head, materials, step = re.split(r"(?=\*MATERIAL, NAME=RUBBER|\*STEP)", text)
        text = f"{head}*INCLUDE, INPUT=materials.inp\n{step}"
        (folder / "materials.inp").write_text(materials)
    path = folder / "tyre.inp"
    path.write_bytes(text.replace("\n", "\r\n").encode("latin-1"))
    deck = read_own_deck(path)
    numbers = {"C10": 0.8} if name == "millimetres" else {}
    flat = deck.flat(numbers)
    case = own_case(deck, flat, "not given", None, numbers)
    path.with_suffix(".yaml").write_text(case)
    return path


@pytest.mark.parametrize("name", ["millimetres", "parameters", "cae"])
def test_a_users_deck_as_fitted(name: str, tmp_path: Path) -> None:
    """Decks in mm with an included file and a mark, with *PARAMETER, with a part: only numbers
    change, and a case of nothing but the new deck has the frequencies."""
    old = deck_of(name, tmp_path)
    fit = with_fit(old.with_suffix(".yaml"), 1.1, {}, "deck")
    arguments = ["--format", "deck", "--case", str(old.with_suffix(".yaml"))]
    assert run("export", str(fit), *arguments) == 0
    folder = fit.parent / "export"
    changed = 0
    for path in tmp_path.glob("*.inp"):
        before, after = path.read_bytes(), (folder / path.name).read_bytes()
        changed += before != after
        old_lines, lines = (numbers_apart(text.decode("latin-1")) for text in (before, after))
        assert lines == old_lines
    assert changed == (2 if name == "millimetres" else 1)
    short = folder / "short.yaml"
    short.write_text("format: 1\ndeck: {file: tyre.inp}\n")
    assert frequencies(short) == frequencies(old.with_suffix(".yaml"), fit)


def test_commands_of_one_design_take_the_fitted_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = deck_of("cae", tmp_path).with_suffix(".yaml")
    fit = with_fit(case, 1.1, {}, "deck")
    output = ["--output", str(tmp_path / "out")]
    few = ["--set", "analysis.highest_harmonic=0", "--no-store", "--json"]
    assert run("modes", str(case), "--fitted", str(fit), *few, *output) == 0
    printed = json.loads(capsys.readouterr().out)
    variables = json.loads(fit.read_text())["variables"]
    values = {name: entry["value"] for name, entry in variables.items()}
    assert printed["variables"] == values
    assert printed["provenance"]["overrides"].items() >= values.items()
    hertz = [round(mode["frequency_Hz"], 6) for mode in printed["modes"]]
    assert hertz == frequencies(case, fit)[1:]
    assert run("deck", str(case), "--fitted", str(fit.parent), *output) == 0
    area = next(value for name, value in values.items() if name.startswith("A_"))
    assert f"{area:.13g}" in (tmp_path / "out" / "inflate.inp").read_text()
    (name, *_) = values
    for command in ("modes", "deck"):
        wrong = [command, str(case), "--fitted", str(fit), "--set", f"{name}={values[name]}"]
        assert run(*wrong, *output) == 2
        assert f"--set {name}: the design is that of --fitted" in capsys.readouterr().err


def test_an_export_writes_over_no_other_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without --force; and the case is at its place, or is named."""
    case = deck_of("cae", tmp_path).with_suffix(".yaml")
    fit = with_fit(case, 1.1, {}, "deck")
    assert run("export", str(fit)) == 2
    assert "give it by --case CASE" in capsys.readouterr().err
    arguments = ["export", str(fit), "--case", str(case)]
    assert run(*arguments, "--solver", "abaqus") == 2
    assert "--solver goes with --format deck" in capsys.readouterr().err
    assert run(*arguments) == 0 == run(*arguments)
    new = fit.parent / "export" / "tyre_fitted.yaml"
    content = new.read_text()
    new.write_text("mine")
    capsys.readouterr()
    assert run(*arguments) == 2 and new.read_text() == "mine"
    assert f"'{new}' exists already; give --force" in capsys.readouterr().err
    assert run(*arguments, "--force") == 0 and new.read_text() == content


LAYOUTS = """# mine
rim: {reference_point_m: {r: 0.0, z: 0.0}}   # held
road:
  loads_N: [1.0e+3, 2000]
  wheel:
variables:
  # stiff
  x:
    start: 1.0   # first
"""


def test_numbers_are_set_in_any_layout() -> None:
    """A flow or block mapping, a list, a key without a value; what is absent is added."""
    values: dict[Keys, Any] = {
        ("rim", "reference_point_m", "z"): -0.5,
        ("rim", "free"): True,
        ("road", "loads_N", 1): 3000.0,
        ("road", "wheel"): "held",
        ("variables", "x", "start"): 2.5e-07,
        ("variables", "x", "percent"): None,
        ("effects", "rim_width"): 1e-3,
        ("deck", "numbers", "material A / DENSITY / density"): 4.0,
        ("spin_rad_per_s",): 5.0,
    }
    assert (
        set_in_text(LAYOUTS, values)
        == """# mine
rim: {free: true, reference_point_m: {r: 0.0, z: -0.5}}   # held
road:
  loads_N: [1.0e+3, 3000.0]
  wheel: held
variables:
  # stiff
  x:
    percent: null
    start: 2.5e-07   # first

effects:
  rim_width: 0.001

deck:
  numbers: {material A / DENSITY / density: 4.0}

spin_rad_per_s: 5.0
"""
    )


def test_decks_in_three_dimensions_as_fitted(tmp_path: Path) -> None:
    """The mark has the fitted number, and nothing else changes."""
    for path in (CASES / "ring_3d").iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    case = tmp_path / "ring.yaml"
    fit = with_fit(case, 1.1, {}, "deck")
    assert run("export", str(fit), "--format", "deck", "--case", str(case)) == 0
    texts = {path.name: path.read_text() for path in (fit.parent / "export").glob("*.inp")}
    old = {path.name: path.read_text() for path in tmp_path.glob("*.inp")}
    assert texts == {name: re.sub(MARK, "4950000", text) for name, text in old.items()}
    assert any(re.search(MARK, text) for text in old.values())


def test_an_export_reports_what_the_deck_has_no_place_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Gas in the case stays there; gauges that are not the deck's are refused."""
    case = deck_of("cae", tmp_path).with_suffix(".yaml")
    fit = with_fit(case, 1.1, {"cavity.share": 0.5}, "deck")
    arguments = ["export", str(fit), "--case", str(case), "--format", "deck"]
    assert run(*arguments) == 0
    assert "your deck does not contain the gas in the cavity" in capsys.readouterr().err
    fit.write_text(fit.read_text().replace("cavity.share", "analysis.highest_harmonic"))
    assert run(*arguments) == 2
