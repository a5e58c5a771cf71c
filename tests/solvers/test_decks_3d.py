"""A user's decks in three dimensions, on CalculiX and on a stand-in of ABAQUS."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.errors import RunFailed
from tyrecal_solvers.rings import about_axle, ring_modes

from tyrecal.simulate.deck.decks import Decks, without_header
from tyrecal.simulate.deck.decks_design import DecksDesign, added_words
from tyrecal.simulate.evaluate.results import RawMode, RingShape
from tyrecal.simulate.modes.label import belt_motion, paired_labels
from tyrecal.tyre.load import load_case, validate
from tyrecal.tyre.own_deck.text import read_blocks

from ..chance import generator
from ..cli.test_cli import run
from ..conftest import CASES
from . import decks_3d

STANDIN = Path(__file__).with_name("standin_decks_3d.py")
TEXTS = decks_3d.FILES
FREE = "rim: {reference_point_m: {r: 0, z: 0}, free: true}\nsolver:"


def case_of(folder: Path, case: str = decks_3d.CASE, **texts: str) -> Path:
    """The case beside its decks, some of which (``modes``) have other texts."""
    others = {f"{job}.inp": text for job, text in texts.items()}
    for file, text in {**TEXTS, **others, "ring.yaml": case}.items():
        (folder / file).write_text(text)
    return folder / "ring.yaml"


def line_of(text: str, words: str) -> int:
    """The first line, from 1, with these words; 0 where none has."""
    return next((i for i, line in enumerate(text.splitlines(), 1) if words in line), 0)


def twin(folder: Path, c10: float, pressure: float, capsys: Any) -> dict[str, float]:
    """Frequencies, Hz, of the axisymmetric twin on the bundled solver, by label."""
    folder = folder / f"{c10:g}"
    folder.mkdir()
    (folder / "twin.inp").write_text(decks_3d.axisymmetric(c10, pressure))
    deck, section = str(folder / "twin.inp"), str(folder / "twin.yaml")
    assert run("init", "--deck", deck, "--output", section) == 0
    given = ("--allow-unusual", "--no-store", "--json", "--output", str(folder / "twin"))
    capsys.readouterr()
    return frequencies(capsys, "modes", section, *given)


def frequencies(capsys: Any, *command: str) -> dict[str, float]:
    """Frequencies of a command's modes, by label."""
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
    components = [(name, u @ turn.T) for name, halves in shapes.items() for u in halves]
    hertz = 10.0 * (1 + np.repeat(np.arange(len(shapes)), [len(u) for u in shapes.values()]))
    local, frame = about_axle(points @ turn.T + rng.normal(size=3))
    vectors = np.array([u for _, u in components]) @ frame.T
    places, modes = ring_modes((2 * np.pi * hertz) ** 2, local, vectors)
    assert places[:, 0] == pytest.approx(np.full(len(theta), 0.3), rel=1e-9)
    raw = [RawMode(m["frequency_Hz"], RingShape(places, m["displacement"]), 1) for m in modes]
    by_label = {str(mode.label): mode for mode in paired_labels(raw)}
    assert list(by_label) == list(shapes)
    assert [mode.multiplicity for mode in by_label.values()] == [len(u) for u in shapes.values()]


def test_waves_that_few_nodes_cannot_tell_apart_are_the_fewer_ones() -> None:
    """Waves 2 and 10 are the same with 12 nodes round the tyre, also as printed with six digits."""
    theta = 2 * np.pi * np.arange(12) / 12 + 0.1
    points = 0.3 * np.stack([np.cos(theta), np.sin(theta), 0 * theta], -1)
    shapes = np.array([np.cos(2 * theta + phase)[:, None] * points for phase in (0.4, 1.2)])
    local, frame = about_axle(np.round(points, 6))
    places, modes = ring_modes(np.ones(2), local, np.round(shapes, 6) @ frame.T)
    for mode in modes:
        assert belt_motion(RingShape(places, mode["displacement"])).c == 2


def test_nodes_that_are_no_ring() -> None:
    angles = np.linspace(0, np.pi, 20)
    arc = np.stack([np.cos(angles), np.sin(angles), 0 * angles], -1)
    with pytest.raises(RunFailed, match="are not round the axle"):
        ring_modes(np.ones(1), about_axle(arc)[0], arc[None])


@pytest.mark.parametrize("solver", ["abaqus", "calculix"])
def test_the_text_is_the_users_but_for_the_marks(solver: str, tmp_path: Path) -> None:
    """The text changes at marks, at another pressure, and by the lines that are reported as
    added."""
    case = load_case(case_of(tmp_path))

    def written(values: dict[str, float]) -> dict[str, str]:
        texts = Decks(DecksDesign(case, values)).texts(solver)
        return {file: without_header(text.encode()).decode() for file, text in texts.items()}

    words = added_words(case.kind.decks, solver)
    added = words.rpartition("modes: ")[2].replace(" / ", "\n") + "\n"
    same = written({})
    assert "modes.inp, line 8: added before it" in words
    assert same["mesh.inp"] == TEXTS["mesh.inp"]
    first = TEXTS["inflate.inp"].replace(decks_3d.MARKED, "4500000")
    if solver == "abaqus":  # whose results file has one format, which a restart does not change
        assert words.startswith("inflate.inp, line 11: added before it")
        first = first.replace("*STEP", "*FILE FORMAT, ASCII\n*STEP")
    assert same["inflate.inp"] == first
    assert same["modes.inp"] == TEXTS["modes.inp"].replace("*END STEP", f"{added}*END STEP")
    if solver == "abaqus":
        (tmp_path / "same").mkdir()
        for file, text in same.items():
            (tmp_path / "same" / file).write_text(text)
        old, _ = read_blocks(tmp_path / "same" / "inflate.inp")
        assert not findings(old)
        assert not findings(read_blocks(tmp_path / "same" / "modes.inp")[0], old)
    path = "material RUBBER / DENSITY / density"
    other = written({"C10": 4e6, "pressure_kPa": 60.0, path: 1000.0})
    changed = [
        pair
        for file in same
        for pair in zip(same[file].splitlines(), other[file].splitlines(), strict=True)
        if pair[0] != pair[1]
    ]
    assert changed == [
        ("4500000, 1e-08", "4000000, 1e-08"),
        ("1100.0", "1000"),
        ("RUBBER, P6, 50000.0", "RUBBER, P6, 60000"),
        ("RUBBER, P6, 25000.0", "RUBBER, P6, 30000"),
    ]


def test_a_pressure_by_mark(tmp_path: Path) -> None:
    """The pressure is in the decks' unit, here MPa; other pressures stay."""
    text = TEXTS["modes.inp"].replace("25000.0", "{{ pressure }}")
    case = load_case(case_of(tmp_path, decks_3d.CASE.replace("units: m", "units: mm"), modes=text))
    texts = Decks(DecksDesign(case, {"pressure_kPa": 60.0})).texts("calculix")
    assert "P6, 0.06\n" in texts["modes.inp"] and "P6, 50000.0\n" in texts["inflate.inp"]


@pytest.mark.parametrize(
    ("job", "old", "new", "place", "words"),
    [
        ("case", "crown: CROWN", "crown: CRWON", "crown:", "no node set .*; did you mean 'CROWN'"),
        (
            "case",
            "  crown:",
            "  numbers: {C11: 1.0}\n  crown:",
            "numbers",
            "is no mark and no numb",
        ),
        ("case", "[inflate.inp, ", "[inflat.inp, ", "decks:", "there is none of this name"),
        ("case", "[inflate.inp", "[inflate.inp, inflate.inp", "decks:", "is given twice"),
        ("case", "  units: m", "  units: m\n  file: inflate.inp", "decks:", "absent with file"),
        ("case", "  units: m", "  units: m\n  parts: {tread: [A]}", "parts", "absent with decks"),
        ("case", "solver:", "cavity: {share: 1.0}\nsolver:", "cavity", "absent with deck.decks"),
        ("case", "solver:", FREE, "rim:", "must be held"),
        ("case", "solver:", "analysis: {sectors: 20}\nsolver:", "analysis", "must say"),
        (
            "case",
            "solver:",
            "effects: {tread_wear: 0.5}\nsolver:",
            "effects",
            "in three dimensions",
        ),
        ("case", "Hz: 121.744", "Hz: 121.744, rim: free", "rim: free", "the decks state how"),
        ("case", "calculix", "bundled", "no line", "cannot express decks in three dimensions"),
        ("inflate", "{{ C10 }}", "{{ C11 }}", "{{ C11 }}", "the mark C11 has no number"),
        ("modes", "*FREQUENCY", "*STATIC", "*RESTART", "one step with .FREQUENCY, it has 0"),
        ("modes", "*END STEP", "", "*STEP", "has no .END STEP"),
        ("modes", "*END", "*NODE FILE, NSET=RIM\nU\n*END", "*NODE", "only NSET=CROWN"),
        ("modes", "10\n", "ten\n", "ten", "'ten' is no whole number"),
        ("modes", "P6, 25000.0", "P6, <p>", "<p>", "P6, <p> is no plain pressure"),
        ("modes", "*DLOAD\n", "*DLOAD, AMPLITUDE=A\n", "P6", "amplitude A does not end at 1"),
        ("modes", "P6", "HP6", "HP6", "is no plain pressure: write {{ pressure }}"),
        ("modes", "*END", "*NODE FILE, NSET=CROWN, MODE=7\nU\n*END", "*NODE", "of all modes"),
        (
            "inflate",
            "*STEP",
            "*RESTART, READ\n*STEP",
            "*RESTART",
            "no deck before this one has its name",
        ),
    ],
)
def test_what_is_wrong_is_said_by_file_line_and_key(
    job: str, old: str, new: str, place: str, words: str, tmp_path: Path, capsys: Any
) -> None:
    file = "ring.yaml" if job == "case" else f"{job}.inp"
    text = TEXTS[file].replace(old, new)
    case = case_of(tmp_path, **{job: text})
    assert run("validate", str(case), "--json") == 2
    mistakes = json.loads(capsys.readouterr().out)
    (mistake,) = (each for each in mistakes if re.search(words, each["message"]))
    assert len(mistakes) == 1 or new == "{{ C11 }}"  # where C10 is no mark any longer
    assert Path(mistake["file"]).name == file
    line = line_of(text, place)
    assert mistake["line"] in ((line, line - 1) if job == "inflate" else (line,))


def test_a_case_is_made_of_decks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The decks' plain numbers are variables of the case; the user states their crown and order."""
    text = TEXTS["inflate.inp"].replace(decks_3d.MARKED, "4500000.0")
    case_of(tmp_path, inflate=text, modes=decks_3d.modes(calculix=False))
    pair = [
        word for job in ("inflate", "modes") for word in ("--deck", str(tmp_path / job) + ".inp")
    ]
    assert run("init", *pair, "--crown-set", "CRWON") == 2
    assert "they have RIM, CROWN" in capsys.readouterr().err
    assert run("init", *pair, "--output", str(tmp_path / "made.yaml"), "--json") == 0
    out = json.loads(capsys.readouterr().out)
    assert not out["abaqus"]["refuses"] and not out["abaqus"]["unknown"]
    loaded = load_case(tmp_path / "made.yaml")
    assert loaded.kind.decks and loaded.case.pressure_kPa == 50.0
    assert loaded.case.variables["C10_RUBBER"].start == decks_3d.C10
    assert run("init", "--deck", pair[1], "--output", str(tmp_path / "one.yaml")) == 2
    assert "the last deck finds the modes" in capsys.readouterr().err


def test_what_abaqus_refuses_of_decks_is_said_by_file_and_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The adapter refuses the same decks. In space, layers that fan out need an orientation."""
    fanned = "*ELEMENT, TYPE=SFM3D4R, ELSET=PLY\n9001, 1, 2, 5, 4\n*SURFACE SECTION, ELSET=PLY\n"
    fanned += "*REBAR LAYER, GEOMETRY=ANGULAR\nPLY, 1e-7, 0.2, 0.0, RUBBER, 0.0\n*MATERIAL, "
    text = TEXTS["inflate.inp"].replace("*MATERIAL, ", fanned, 1)
    for solver, code in (("abaqus", 2), ("calculix", 0)):
        case = case_of(tmp_path, decks_3d.CASE.replace("calculix", solver), inflate=text)
        assert run("deck", "--check", str(case), "--json") == code
        report = json.loads(capsys.readouterr().out)
        (refusal,) = report["abaqus"]["refuses"]
        assert refusal.startswith("inflate.inp, line 7: *REBAR LAYER: needs an ORIENTATION")
        assert report["calculix"] == [
            "inflate.inp, line 6: *SURFACE SECTION: it has no rebar: cords are solids of a stiff"
            " direction there"
        ]


def test_no_pressure_is_found(tmp_path: Path) -> None:
    text = TEXTS["inflate.inp"].replace("P6", "BX")
    (mistake,) = validate(case_of(tmp_path, inflate=text, modes=decks_3d.modes(calculix=False)))
    assert "no pressure is found" in mistake.message and "{{ pressure }}" in mistake.message


@pytest.mark.slow
def test_modes_on_abaqus_are_the_twins(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Modes agree to the digits of a .fil; pressure and mark are those of the case, the axle is
    x."""
    case = case_of(tmp_path, modes=decks_3d.modes(calculix=False))
    command = ("--solver", "abaqus", "--solver-command", f"{sys.executable} {STANDIN}")
    given = ("--set", "C10=4e6", "--pressure-kPa", "60", "--json", "--no-store")
    where = ("--output", str(tmp_path / "modes"))
    by_label = frequencies(capsys, "modes", str(case), *given, *where, *command)
    expected = twin(tmp_path, 4e6, 6e4, capsys)
    assert {*by_label} >= {"0,0 axial", "0,0 torsional", "1,1", "2,1", "3,1"}
    for label, hertz in by_label.items():
        assert hertz == pytest.approx(expected[label], rel=1e-9)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("footprint",), "cannot press a tyre on a road"),
        (("footprint", "--solver", "bundled"), "cannot express decks in three dimensions"),
        (("modes", "--load-N", "3000"), "cannot find modes of a tyre on a road"),
        (("diagnose", "--measured"), "is given by decks in three dimensions"),
        (("modes", "--set", "rim.free=true"), "must be held"),
    ],
)
def test_what_needs_a_section_is_refused(
    command: tuple[str, ...], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case, measured = case_of(tmp_path), tmp_path / "measured.csv"
    measured.write_text("label,frequency_Hz,sigma_Hz,pressure_kPa,load_N\n[2;1],121,1,50,0\n")
    given = [str(measured)] if command[0] == "diagnose" else []
    output = ("--output", str(tmp_path / "out"))
    assert run(*command, *given, str(case), *output) == 2
    *_, last = capsys.readouterr().err.splitlines()
    assert words in last


def test_a_check_says_what_is_known_and_added(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The decks are written with the folders of their includes."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mesh.inp").write_text(TEXTS["mesh.inp"])
    inflate = TEXTS["inflate.inp"].replace("mesh.inp", "parts/mesh.inp")
    case = str(case_of(tmp_path, inflate=inflate))
    assert run("deck", "--check", case, "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["jobs"] == [["inflate", ""], ["modes", "inflate"]]
    assert (report["modes"], report["crown"]) == (10, "CROWN")
    line = line_of(inflate, "RUBBER, P6")
    assert report["pressure"] == [f"inflate.inp, line {line}", "modes.inp, line 7"]
    assert report["numbers"] == {
        "C10": 4.5e6,
        "material RUBBER / HYPERELASTIC / D1": 1e-8,
        "material RUBBER / DENSITY / density": 1100.0,
    }
    assert set(report["added"]) == {"abaqus", "calculix"}
    assert run("deck", case, "--solver", "abaqus", "--output", str(tmp_path / "out")) == 0
    written = (tmp_path / "out" / "parts" / "mesh.inp").read_bytes()
    assert without_header(written).decode() == TEXTS["mesh.inp"]


def test_the_example_is_the_tests_own() -> None:
    for file, text in TEXTS.items():
        assert (CASES / "ring_3d" / file).read_text(encoding="utf-8") == text


@pytest.mark.ccx
def test_a_fit_on_calculix_finds_the_twins_rubber(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Targets are the bundled solver's of the section; bricks of 22 degrees are 0.1 % stiffer."""
    begin = twin(tmp_path, decks_3d.C10, decks_3d.PRESSURE, capsys)
    truth = twin(tmp_path, 4e6, decks_3d.PRESSURE, capsys)
    given = ("--report", "--json", "--no-store", "--output", str(tmp_path / "fit"))
    assert run("fit", str(case_of(tmp_path)), *given) == 0
    out, err = capsys.readouterr()
    fit = json.loads(out)
    assert "modes.inp, line 8: added before it" in err
    assert fit["variables"]["C10"]["value"] == pytest.approx(4e6, rel=5e-3)
    assert fit["mass_kg"] == pytest.approx(5.10, rel=1e-2)
    for mode in fit["modes"]:
        label = f"{mode['c']},{mode['m']} {mode['kind'] or ''}".strip()
        assert mode["target_Hz"] == pytest.approx(truth[label], rel=1e-5)
        assert mode["initial_Hz"] == pytest.approx(begin[label], rel=2e-3)
        assert mode["fitted_Hz"] == pytest.approx(truth[label], rel=2e-3)
