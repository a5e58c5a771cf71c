"""tyrecal effects: list, explain, compute."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.signature import Plain
from tyrecal.tyre.effects import IDS, catalogue

from ..effects.support import CASE as LOADED
from ..effects.support import START
from .test_cli import run

FINE = "{crown: 8, upper_sidewall: 8, lower_sidewall: 8, bead: 2}"
KEYS = {"id", "title", "unit", "low", "high", "solvers", "toggle", "aliases"}


@pytest.fixture
def coarse(case_folder: Path) -> str:
    path = case_folder / "p235_75r17.yaml"
    text = (
        path.read_text()
        .replace(FINE, FINE.replace("8", "3"))
        .replace("[1, 1, 1, 3]", "[1, 1, 1, 1]")
    )
    path.write_text(text)
    return str(path)


def test_list_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("effects", "--json") == 0
    entries = json.loads(capsys.readouterr().out)
    assert [entry["id"] for entry in entries] == list(IDS)
    assert all(set(entry) >= KEYS and "bundled" in entry["solvers"] for entry in entries)
    by_id = {entry["id"]: entry for entry in entries}
    assert "calculix" in by_id["cap_ply"]["solvers"]
    assert "calculix" not in by_id["dynamic_stiffening"]["solvers"]


def test_list_and_words_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("effects") == 0
    table = capsys.readouterr().out
    assert all(id in table for id in IDS)
    assert run("effects", "bead_filler") == 0
    words = " ".join(capsys.readouterr().out.split())
    effect = catalogue()["bead_filler"]
    for part in (effect.title, effect.signature, effect.toggle, *effect.changes, "times 1 + value"):
        assert part in words


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["bead_filer"], "did you mean 'bead_filler'"),
        (["--value", "1"], "--value needs the NAME"),
        (["cap_ply", "--value", "1"], "--value needs a --case"),
        (["--mesh", "refined"], "--mesh needs a --case"),
        (["--jobs", "2"], "--jobs needs a --case"),
        (["--no-store"], "--no-store needs a --case"),
        (["cap_ply", "--store", "record"], "--store needs a --case"),
        (["cap_ply", "--no-pictures"], "--no-pictures needs a --case"),
        (["cap_ply", "--case", "CASE", "--pressures-kPa", "200,x"], "200,x: must be numbers in"),
        (["cap_ply", "--case", "CASE", "--pressures-kPa", "200,200"], "each once"),
        (
            ["cap_ply", "--case", "CASE", "--set", "C10=1e6", "--fitted", "CASE"],
            "--set C10: the design is that of --fitted",
        ),
    ],
)
def test_wrong_input(
    arguments: list[str], words: str, coarse: str, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [coarse if word == "CASE" else word for word in arguments]
    assert run("effects", *given) == 2
    assert words in " ".join(capsys.readouterr().err.split())


def test_signature_in_files(
    coarse: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    arguments = ["effects", "rim_width", "--case", coarse, "--value", "0.005"]
    arguments += ["--pressures-kPa", "200,240", "--output", str(out), "--json"]
    assert run(*arguments) == 0
    (entry,) = json.loads(capsys.readouterr().out)
    assert entry == json.loads((out / "effects.json").read_text())[0]
    assert [row["pressure_kPa"] for row in entry["rows"]] == [200, 240]
    assert all(len(row["modes"]) == 9 for row in entry["rows"])
    assert 0 < entry["after_percent"] < entry["before_percent"]
    assert (out / "effect_rim_width.png").stat().st_size > 10_000


def test_words_and_signature_have_the_range_on_that_tyre(
    coarse: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """At 400 kPa a run warms by as much as at 240: by less per 100 kPa."""
    path = Path(coarse)
    text = path.read_text().replace("\npressure_kPa: 240", "\npressure_kPa: 400")
    path.write_text(text)
    arguments = [
        "effects",
        "temperature_drift",
        "--case",
        coarse,
        "--output",
        str(tmp_path / "out"),
    ]
    assert run(*arguments, "--pressures-kPa", "300,400", "--no-pictures") == 0
    assert "-3 to 3 K per 100 kPa" in capsys.readouterr().out
    (entry,) = json.loads((tmp_path / "out" / "effects.json").read_text())
    assert (entry["low"], entry["high"], entry["value"]) == pytest.approx((-3.0, 3.0, 3.0))


@pytest.mark.slow
def test_signatures_are_the_same_bytes_from_worker_processes(coarse: str, tmp_path: Path) -> None:
    arguments = ["effects", "rim_width", "--case", coarse, "--no-pictures", "--quiet"]
    for jobs in ("1", "2"):
        out = ["--output", str(tmp_path / jobs), "--jobs", jobs]
        assert run(*arguments, "--pressures-kPa", "200,240", *out) == 0
    one, two = ((tmp_path / jobs / "effects.json").read_bytes() for jobs in ("1", "2"))
    assert one == two


def test_a_failing_effect_costs_no_other(
    coarse: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["effects", "tread_wear", "--case", coarse, "--value", "2", "--allow-unusual"]
    assert run(*arguments, "--output", str(tmp_path / "out"), "--no-pictures") == 3
    assert "tread_wear must be" in capsys.readouterr().err
    assert json.loads((tmp_path / "out" / "effects.json").read_text()) == []


def test_re_fit_finds_the_variable_that_an_effect_is_and_leaves_what_is_across() -> None:
    plain = Plain(LOADED, Evaluator(TyreDesign(LOADED)), START, (160.0, 240.0))
    signature = plain.signature("temperature", 1.0)
    assert signature.absorbed == pytest.approx(1, abs=1e-4)
    assert signature.refitted["C10"] == pytest.approx(0.9925 * START["C10"], rel=1e-3)
    assert signature.refitted["A_belt"] == pytest.approx(START["A_belt"], rel=1e-3)
    rest = np.log1p(plain.signature("cap_ply", 1e6).after / 100) * plain.weights
    across = np.einsum("pm,pmv->v", rest, plain.jacobian * plain.weights[:, :, None])
    assert across == pytest.approx(0, abs=1e-10)
