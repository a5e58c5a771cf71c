"""A user's decks in three dimensions, on CalculiX and on a stand-in of ABAQUS."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.errors import RunFailed
from tyrecal_solvers.rings import about_axle, ring_modes

from tyrecal.simulate.deck.decks import Decks, without_header
from tyrecal.simulate.deck.decks_design import DecksDesign, added_words
from tyrecal.simulate.evaluate.results import RawMode, RingShape
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.tyre.load import load_case, validate

from ..chance import generator
from ..cli.test_cli import run
from . import decks_3d

STANDIN = Path(__file__).with_name("standin_decks_3d.py")
TEXTS = {
    "mesh.inp": decks_3d.mesh(),
    "inflate.inp": decks_3d.inflate(),
    "modes.inp": decks_3d.modes(),
}
FREE = "rim: {reference_point_m: {r: 0, z: 0}, free: true}\nsolver:"


def case_of(folder: Path, case: str = decks_3d.CASE, **texts: str) -> Path:
    """The case beside its decks, some of which (``modes``) have other texts."""
    for file, text in {**TEXTS, **{f"{job}.inp": text for job, text in texts.items()}}.items():
        (folder / file).write_text(text)
    (folder / "case.yaml").write_text(case)
    return folder / "case.yaml"


def twin(folder: Path, c10: float, pressure: float, capsys: Any) -> dict[str, float]:
    """Frequencies, Hz, of the axisymmetric twin on the bundled solver, by label."""
    (folder / "twin.inp").write_text(decks_3d.axisymmetric(c10, pressure))
    deck, section = str(folder / "twin.inp"), str(folder / "twin.yaml")
    assert run("init", "--deck", deck, "--output", section) == 0
    given = ("--allow-unusual", "--no-store", "--json", "--output", str(folder / "twin"))
    capsys.readouterr()
    return frequencies(capsys, "modes", section, *given)


def frequencies(capsys: Any, *command: str) -> dict[str, float]:
    """Of a command's modes, by label."""
    assert run(*command) == 0
    modes = json.loads(capsys.readouterr().out)["modes"]
    return {f"{m['c']},{m['m']} {m['kind'] or ''}".strip(): m["frequency_Hz"] for m in modes}


@pytest.mark.numbers
@pytest.mark.parametrize("lines", [1, 3])
def test_a_ring_is_labelled_wherever_its_axle_is(lines: int) -> None:
    """Shapes of known labels at nodes closer on one side, turned and shifted by chance."""
    rng = generator(lines)
    angles = np.cumsum(rng.uniform(0.5, 1.5, 40))
    theta = np.tile(2 * np.pi * angles / angles[-1], lines)
    across = np.repeat(np.linspace(-1, 1, lines) if lines > 1 else [0.0], 40)
    points = np.stack([0.3 * np.cos(theta), 0.3 * np.sin(theta), 0.06 * across], -1)
    radial, along, zero = points * [1, 1, 0] / 0.3, np.array([0.0, 0.0, 1.0]), 0 * theta
    round_ = np.stack([-np.sin(theta), np.cos(theta), zero], -1)
    wave = lambda c, m, half: np.cos(c * theta - half * np.pi / 2)[:, None]
    shapes = {
        "[0,0] axial": [along + 0 * points],
        "[0,0] torsional": [round_],
        "[1,0]": [np.eye(3)[i] + 0 * points for i in (0, 1)],
        "[1,1]": [np.cross(np.eye(3)[i], points) for i in (0, 1)],
        "[2,0]": [wave(2, 0, i) * radial - wave(2, 0, i - 1) * round_ / 2 for i in (0, 1)],
        "[3,1]": [wave(3, 1, i) * (along - across[:, None] * radial / 3) for i in (0, 1)],
    }
    if lines > 1:
        shapes["[2,2]"] = [wave(2, 2, i) * radial * (3 * across**2 - 1)[:, None] for i in (0, 1)]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    told = [(name, u @ turn.T) for name, halves in shapes.items() for u in halves]
    hertz = 10.0 * (1 + np.repeat(np.arange(len(shapes)), [len(u) for u in shapes.values()]))
    local, frame = about_axle(points @ turn.T + rng.normal(size=3))
    vectors = np.array([u for _, u in told]) @ frame.T
    places, modes = ring_modes((2 * np.pi * hertz) ** 2, local, vectors)
    assert places[:, 0] == pytest.approx(np.full(len(theta), 0.3), rel=1e-9)
    raw = [RawMode(m["frequency_Hz"], RingShape(places, m["displacement"]), 1) for m in modes]
    found = {str(mode.label): mode for mode in paired_labels(raw)}
    assert list(found) == list(shapes)
    assert [mode.multiplicity for mode in found.values()] == [len(u) for u in shapes.values()]


def test_nodes_that_are_no_ring() -> None:
    angles = np.linspace(0, np.pi, 20)
    arc = np.stack([np.cos(angles), np.sin(angles), 0 * angles], -1)
    with pytest.raises(RunFailed, match="do not lie round the axle"):
        ring_modes(np.ones(1), about_axle(arc)[0], arc[None])


@pytest.mark.parametrize("solver", ["abaqus", "calculix"])
def test_the_text_is_the_users_but_for_the_marks(solver: str, tmp_path: Path) -> None:
    """And for a pressure that is another, wherever it stands, and what is said to be added."""
    case = load_case(case_of(tmp_path))

    def written(values: dict[str, float]) -> dict[str, str]:
        texts = Decks(DecksDesign(case, values)).texts(solver)
        return {file: without_header(text.encode()).decode() for file, text in texts.items()}

    assert case.decks
    words = added_words(case.decks, solver)
    added = words.partition("modes: ")[2].replace(" / ", "\n") + "\n"
    same = written({})
    assert words.startswith("modes.inp, line 7: added before it")
    assert same["mesh.inp"] == TEXTS["mesh.inp"]
    assert same["inflate.inp"] == TEXTS["inflate.inp"].replace(decks_3d.MARKED, "5000000")
    assert same["modes.inp"] == TEXTS["modes.inp"].replace("*END STEP", f"{added}*END STEP")
    path = "material RUBBER / DENSITY / density"
    other = written({"C10": 4e6, "pressure_kPa": 60.0, path: 1000.0})
    changed = [
        pair
        for file in same
        for pair in zip(same[file].splitlines(), other[file].splitlines(), strict=True)
        if pair[0] != pair[1]
    ]
    assert changed == [
        ("5000000, 1e-08", "4000000, 1e-08"),
        ("1100.0", "1000"),
        ("RUBBER, P6, 50000.0", "RUBBER, P6, 60000"),
        ("RUBBER, P6, 25000.0", "RUBBER, P6, 30000"),
    ]


def test_a_pressure_by_mark(tmp_path: Path) -> None:
    """In the decks' unit, here MPa; what else is a pressure stays."""
    text = TEXTS["modes.inp"].replace("25000.0", "{{ pressure }}")
    case = load_case(case_of(tmp_path, decks_3d.CASE.replace("units: m", "units: mm"), modes=text))
    texts = Decks(DecksDesign(case, {"pressure_kPa": 60.0})).texts("calculix")
    assert "P6, 0.06\n" in texts["modes.inp"] and "P6, 50000.0\n" in texts["inflate.inp"]


@pytest.mark.parametrize(
    ("job", "old", "new", "line", "words"),
    [
        ("case", "crown: CROWN", "crown: CRWON", 8, "no node set .*; did you mean 'CROWN'"),
        ("case", "variables:", "  numbers: {C11: 1.0}\nvariables:", 9, "is no mark and no number"),
        ("case", "decks: [inflate.inp, ", "decks: [inflat.inp, ", 6, "there is none of this name"),
        ("case", "decks: [inflate.inp", "decks: [inflate.inp, inflate.inp", 6, "is given twice"),
        ("case", "  units: m", "  units: m\n  file: inflate.inp", 6, "absent with file"),
        ("case", "solver:", "cavity: {share: 1.0}\nsolver:", 11, "absent with deck.decks"),
        ("case", "solver:", FREE, 11, "held"),
        ("case", "solver:", "analysis: {vibration_frequency_Hz: 60}\nsolver:", 11, "alone"),
        ("case", "calculix", "bundled", 0, "cannot express decks in three dimensions"),
        ("case", "solver:", "effects: {tread_wear: 0.5}\nsolver:", 11, "in three dimensions"),
        (
            "case",
            "solver:",
            "targets: {modes: [{c: 2, m: 1, frequency_Hz: 120, rim: free}]}\nsolver:",
            11,
            "how the rim is held stands in the decks",
        ),
        ("inflate", "{{ C10 }}", "{{ C11 }}", 5, "the mark C11 has no number"),
        ("modes", "*FREQUENCY", "*STATIC", 1, "one step with .FREQUENCY, it has 0"),
        ("modes", "*END STEP", "", 2, "has no .END STEP"),
        ("modes", "*END STEP", "*NODE FILE, NSET=RIM\nU\n*END STEP", 7, "only NSET=CROWN"),
        ("modes", "10\n", "ten\n", 4, "'ten' is no whole number"),
        ("modes", "P6, 25000.0", "P6, <p>", 6, "'<p>' is not a number"),
    ],
)
def test_what_is_wrong_is_said_by_file_line_and_key(
    job: str, old: str, new: str, line: int, words: str, tmp_path: Path, capsys: Any
) -> None:
    if job == "case":
        case = case_of(tmp_path, decks_3d.CASE.replace(old, new))
    else:
        case = case_of(tmp_path, **{job: TEXTS[f"{job}.inp"].replace(old, new)})
    assert run("validate", str(case), "--json") == 2
    (mistake,) = json.loads(capsys.readouterr().out)
    assert mistake["message"] and re.search(words, mistake["message"])
    assert Path(mistake["file"]).name == (case.name if job == "case" else f"{job}.inp")
    assert mistake["line"] == line


def test_no_pressure_is_found(tmp_path: Path) -> None:
    text = TEXTS["inflate.inp"].replace("P6", "BX")
    (found,) = validate(case_of(tmp_path, inflate=text, modes=decks_3d.modes(calculix=False)))
    assert "no pressure is found" in found.message and "{{ pressure }}" in found.message


@pytest.mark.slow
def test_modes_on_abaqus_are_the_twins(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """To what a .fil holds; pressure and mark are those of the case, the axle is x."""
    case = case_of(tmp_path, modes=decks_3d.modes(calculix=False))
    command = ("--solver", "abaqus", "--solver-command", f"{sys.executable} {STANDIN}")
    given = ("--set", "C10=4e6", "--pressure-kPa", "60", "--json", "--no-store")
    given += ("--output", str(tmp_path / "modes"))
    found = frequencies(capsys, "modes", str(case), *given, *command)
    expected = twin(tmp_path, 4e6, 6e4, capsys)
    assert {*found} >= {"0,0 axial", "0,0 torsional", "1,1", "2,1", "3,1"}
    for label, hertz in found.items():
        assert hertz == pytest.approx(expected[label], rel=1e-9)


@pytest.mark.ccx
def test_a_fit_on_calculix_finds_the_twins_rubber(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Targets are the bundled solver's of the section; bricks of 22 degrees are 0.1 % stiffer."""
    expected = twin(tmp_path, 4e6, 6e4, capsys)
    targets = [
        {"c": int(label[0]), "m": int(label[2]), "frequency_Hz": expected[label]}
        | ({"kind": label[4:]} if label[4:] else {})
        for label in ("0,0 axial", "0,0 torsional", "1,1", "2,1")
    ]
    text = decks_3d.CASE.replace("solver:", f"targets: {json.dumps({'modes': targets})}\nsolver:")
    case = case_of(tmp_path, text.replace("pressure_kPa: 50.0", "pressure_kPa: 60"))
    assert run("fit", str(case), "--report", "--json", "--output", str(tmp_path / "fit")) == 0
    out, err = capsys.readouterr()
    fit = json.loads(out)
    assert "added before it" in err
    assert fit["variables"]["C10"]["value"] == pytest.approx(4e6, rel=5e-3)
    for mode in fit["modes"]:
        assert mode["fitted_Hz"] == pytest.approx(mode["target_Hz"], rel=2e-3)
