"""The state that a tyre is in: what it sets of a case, and --set rim.free=true."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.case.identity import is_of_tyre
from tyrecal.tyre.case.parts import Spindle
from tyrecal.tyre.case.schema import Variable
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import SPRINGS, TyreState, rim_of
from tyrecal.tyre.values import overridden, set_values, with_values

from ..cli.test_cli import run
from ..conftest import CASES

CASE = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
SPRUNG = with_values(CASE, {"rim.spindle.radial_m_per_N": 1e-7})
FREE = with_values(CASE, {"rim.free": True})


def in_state(case: LoadedCase, **state: Any) -> LoadedCase:
    return set_values(case, TyreState(**state).numbers(case))


def varied(path: str) -> LoadedCase:
    """The case with a variable v that sets ``path``."""
    v = Variable(sets=[path], start=0.0, lower=0.0, upper=1e-7, scale="linear")
    variables = {**CASE.case.variables, "v": v}
    return replace(CASE, case=CASE.case.model_copy(update={"variables": variables}))


def test_every_way_that_a_case_holds_its_rim_is_known() -> None:
    assert (rim_of(CASE), rim_of(SPRUNG), rim_of(FREE)) == ("fixed", "springs", "free")
    assert rim_of(with_values(CASE, {"effects.wheel_free": 0.05})) == "free"
    for path in SPRINGS:
        assert rim_of(with_values(CASE, {path: 1e-7})) == "springs"
        assert rim_of(varied(path)) == "springs"  # whose start is 0
    assert len(set(SPRINGS)) == 8 and rim_of(varied("cavity.share")) == "fixed"


def test_a_state_is_the_cases_own_or_sets_what_it_has_otherwise() -> None:
    for case in (CASE, SPRUNG, FREE):
        for state in (TyreState(), TyreState(240.0, 4000.0, rim_of(case))):
            assert state.numbers(case) == {}
            assert state.of(case) == TyreState(None, state.load_N, None)
            assert state.with_defaults(case) == TyreState(240.0, state.load_N, rim_of(case))
    assert TyreState(160.0).numbers(CASE) == {"pressure_kPa": 160.0}
    assert TyreState(160.0, 4000.0).unloaded == TyreState(160.0)
    for case in (CASE, SPRUNG, FREE, with_values(CASE, {"effects.wheel_free": 0.05})):
        for rim in ("fixed", "free"):
            there = in_state(case, pressure_kPa=160.0, rim=rim)
            assert rim_of(there) == rim and there.case.pressure_kPa == 160.0
            assert there.case.rim.spindle == Spindle() or rim == rim_of(case)
            assert there.case.rim.mass_kg == CASE.case.rim.mass_kg


def test_a_state_wins_over_a_variable_that_sets_the_same() -> None:
    case, values = varied("effects.spindle_radial"), {"C10": 1e6, "v": 1e-8}
    assert TyreState(160.0).design(case, values) == {**values, "pressure_kPa": 160.0}
    there = TyreState(rim="free").design(case, values)
    assert "v" not in there and there["rim.free"] is True and there["C10"] == 1e6
    assert rim_of(set_values(case, there)) == "free" or there["effects.spindle_radial"] == 0


def test_states_that_a_case_cannot_be_in_are_refused() -> None:
    for case in (CASE, FREE):
        with pytest.raises(ValueError, match="has no springs in this case: give a compliance"):
            TyreState(rim="springs").numbers(case)
    assert TyreState(rim="springs").numbers(SPRUNG) == {}
    apart = with_values(CASE, {"rim.reference_point_m.r": 0.1})
    with pytest.raises(ValueError, match=r"with r = 0, got 0\.1"):
        TyreState(rim="free").numbers(apart)
    assert TyreState(160.0).numbers(apart) == {"pressure_kPa": 160.0}


@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ("rim.free=1", "rim.free must be true or false, got 1"),
        ("C10=true", "C10_Pa must be a number, got true"),
        ("rim.free=yes", "rim.free must be true or false, got yes"),
        ("mesh.element=true", "mesh.element is text, 'CGAX8R'"),
    ],
)
def test_a_switch_is_true_or_false(
    assignment: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("modes", str(CASES / "p235_75r17.yaml"), "--set", assignment) == 2
    assert words in capsys.readouterr().err


def test_a_word_and_null_are_set_as_in_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same decks as of the case that says so; the rim that holds less has another mesh."""
    shutil.copy(CASES / "p235_75r17.csv", tmp_path)
    text = (CASES / "p235_75r17.yaml").read_text()
    whole, edited = tmp_path / "whole.yaml", tmp_path / "edited.yaml"
    whole.write_text(text.replace("vibration_frequency_Hz: null", "vibration_frequency_Hz: 60.0"))
    edited.write_text(text.replace("rim:\n", "rim:\n  holds: bead_surface\n"))
    assert len({text, whole.read_text(), edited.read_text()}) == 3
    given = ["--set", "rim.holds=bead_surface", "--set", "analysis.vibration_frequency_Hz=null"]
    decks = []
    for case, words in ((whole, given), (edited, []), (whole, [])):
        folder = tmp_path / f"decks_{len(decks)}"
        assert run("deck", str(case), "--mesh", "coarse", *words, "--output", str(folder)) == 0
        decks.append([path.read_text() for path in sorted(folder.glob("*.inp"))])
    assert decks[0] == decks[1] != decks[2]
    assert "rim.holds is whole_bead in the case, bead_surface here" in capsys.readouterr().err


def test_a_free_rim_is_set_by_the_command_line_and_told(tmp_path: Path) -> None:
    """It changes the modes of c <= 1 alone, is noted among what was set, and is no other tyre."""
    hertz: dict[str, dict[Any, Any]] = {}
    for name, given in (("held", []), ("free", ["--set", "rim.free=true"])):
        folder = tmp_path / name
        case = [str(CASES / "p235_75r17.yaml"), "--mesh", "coarse", "--no-pictures"]
        assert run("modes", *case, *given, "--output", str(folder)) == 0
        result = json.loads((folder / "modes.json").read_text())
        of = result["provenance"]
        assert of["state"]["rim"] == ("free" if given else "fixed")
        assert of["overrides"] == ({"rim.free": True} if given else {})
        hertz[name] = {(m["c"], m["m"], m["kind"]): m["frequency_Hz"] for m in result["modes"]}
        hertz[name]["tyre"] = of["tyre_sha256"]
    assert hertz["free"].pop("tyre") == hertz["held"].pop("tyre")
    for label, f in hertz["held"].items():
        moved = abs(hertz["free"][label] / f - 1)
        assert moved < 1e-9 if label[0] > 1 else moved > 0.05
    assert not is_of_tyre("rim.free") and is_of_tyre("rim.mass_kg")
    back = overridden(overridden(CASE, {"rim.free": True}), {"rim.free": False})
    assert back.case == CASE.case and back.overrides == {"rim.free": False}
