"""First lines of decks: the tyre that they describe, and nothing that would part equal
questions."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tyrecal.simulate.deck.decks import MAX_NAME_LENGTH, Decks, header, without_header
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.case import start_values, with_level
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import overridden, with_values

from ..cli.test_cli import run
from ..conftest import CASES

CASE = CASES / "p235_75r17.yaml"


@pytest.mark.parametrize(
    ("dialect", "more"), [("abaqus", {}), ("abaqus", {"loads_N": (4e3,)}), ("calculix", {})]
)
def test_every_deck_says_what_it_is_of(dialect: str, more: dict) -> None:
    case = with_level(load_case(CASE), "coarse")
    case = overridden(case, {"rebar_layers.belt_1.angle_deg": 68.0, "C10": 1.2e6})
    texts = Decks(TyreDesign(case, start_values(case)), **more).texts(dialect)
    assert len(texts) > 1
    for text in texts.values():
        first = "".join(text.splitlines(keepends=True)[:3])
        assert first == header(case)
        for words in (case.case.name, tyre_sha256(case), "mesh coarse", "m, kg, s, Pa"):
            assert words in first
        assert not re.search(r"\d\d:\d\d|202\d|/(?!75R17)", first)
        assert without_header(text.encode()).decode() == text.removeprefix(first)
    assert without_header(b"1, 2, 3\n** Written by tyrecal: not a deck\n").startswith(b"1, 2")


def test_the_comment_moves_no_slope() -> None:
    """A number of the tyre that is no variable has another hash a step to either side."""
    case = with_level(load_case(CASE), "coarse")
    paths = ("materials.rubber.density_kg_per_m3", "effects.bead_filler")
    values = {**start_values(case), paths[0]: 1100.0, paths[1]: 1.0}
    moved = with_values(case, {paths[1]: 1.0})
    decks = Decks(TyreDesign(moved, values), tuple(values))
    rows = decks.tangents("abaqus")
    lines = decks.texts("abaqus")["inflate.inp"].splitlines()
    for path in paths:
        assert rows[path]
        for job, line, field, slope in rows[path]:
            assert job == "inflate" and slope
            float(lines[line - 1].split(",")[field])


def test_a_long_name_fits_a_line() -> None:
    case = load_case(CASE)
    long = case.case.model_copy(update={"name": "x" * 300})
    named = type(case)(**{**case.__dict__, "case": long})
    assert all(len(line) < 256 for line in header(named).splitlines())
    assert header(named).count("x") >= MAX_NAME_LENGTH


def test_studies_that_ask_the_same_share_the_record(case_folder: Path) -> None:
    """Whatever the targets, the file's name, comments, --set or the file's own number."""
    path = case_folder / "p235_75r17.yaml"
    out = case_folder / "out"
    own = ["--mesh", "coarse", "--quiet", "--store", str(case_folder / "record"), "--output"]
    turned = ["--set", "rebar_layers.belt_1.angle_deg=68"]
    assert run("modes", str(path), *turned, *own, str(out / "a")) == 0
    text = path.read_text().replace("angle_deg: 70.0", "angle_deg: 68")
    text = text.replace("frequency_Hz: 31.7", "frequency_Hz: 30.0").replace(
        "# Table 2", "# not Table 2"
    )
    text = text.replace("percent: 3.0", "percent: 5.0").replace("upper: 1.0e-5", "upper: 2e-5")
    other = path.with_name("edited.yaml")
    other.write_text(text)
    assert run("modes", str(other), *own, str(out / "b")) == 0
    facts = json.loads((out / "b/run.json").read_text())["modes"]
    assert (facts["solver_runs"], facts["answered_from_record"]) == (0, 1)
    one, two = (json.loads((out / name / "modes.json").read_text()) for name in "ab")
    assert one["modes"] == two["modes"]
    of = one["provenance"], two["provenance"]
    assert of[0]["tyre_sha256"] == of[1]["tyre_sha256"]
    assert of[0]["overrides"] == {"rebar_layers.belt_1.angle_deg": 68.0} and not of[1]["overrides"]


def test_the_users_own_templates_have_it_too(case_folder: Path) -> None:
    folder = case_folder / "own"
    folder.mkdir()
    (folder / "modes.inp.j2").write_text("*HEADING\nmine\n")
    path = case_folder / "p235_75r17.yaml"
    path.write_text(path.read_text() + "\ntemplates: own\n")
    case = load_case(path)
    assert Decks(TyreDesign(case)).texts("abaqus")["modes.inp"] == header(case) + "*HEADING\nmine\n"
