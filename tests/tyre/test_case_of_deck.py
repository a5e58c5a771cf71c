"""A case of a user's deck: what it may leave out, marks, and all of its mistakes at once.

Effects and the diagnosis of a user's deck whose case says which of its sets are which part.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from tyrecal.cli.main import main
from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.load import load_case, validate
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values

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


PARTS = {"tread": ["TREAD"], "sidewall": ["sidewall"], "bead_filler": ["BODY"], "belts": ["BELT"]}
AS_DECK = {"tread_wear": 0.3, "sidewall_gauge": 0.12, "dynamic_stiffening": 0.4}


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> LoadedCase:
    path = tmp_path_factory.mktemp("parts") / "tyre.inp"
    path.write_text(own_decks.compounds())
    deck = read_own_deck(path)
    text = own_case(deck, deck.flat({}), "not given", None)
    text = text.replace("  numbers: {", f"  parts: {json.dumps(PARTS)}\n  numbers: {{")
    path.with_suffix(".yaml").write_text(text.replace("highest_harmonic: 4", "highest_harmonic: 3"))
    return load_case(path.with_suffix(".yaml"))


def radii(case: LoadedCase, **values: float) -> np.ndarray:
    """Radii of the nodes about the section's centre (row, column)."""
    paths = {name.replace("__", "."): value for name, value in values.items()}
    nodes = resolved(with_values(case, paths)).flat.mesh.nodes
    place = {n: k for k, n in enumerate(sorted(own_decks.Tyre().nodes), start=1)}
    grid = np.full((own_decks.ROWS + 1, own_decks.COLUMNS + 1), np.nan)
    for i, j in np.ndindex(grid.shape):
        if own := place.get(own_decks.number(i, j)):
            r, z = nodes[own]
            grid[i, j] = np.hypot(r - own_decks.CENTRE, z)
    return grid


def test_a_layer_of_one_thickness_is_so_many_times_as_thick(case: LoadedCase) -> None:
    """Amid its part; what it lies on and other parts stay, and at its ends it meets them."""
    plain = radii(case)
    worn = radii(case, effects__tread_wear=0.4) - plain
    belt, t = slice(11, 14), plain[4, 12] - plain[2, 12]
    assert worn[4, belt] == pytest.approx(-0.4 * t, rel=0.02)
    assert worn[3, 12] == pytest.approx(-0.2 * t, rel=0.02)
    assert not np.nan_to_num(worn[:3]).any() and not np.nan_to_num(worn[:, [0, 8, 16, 24]]).any()
    thick = radii(case, deck__gauges__sidewall=1.25) - plain
    assert thick[4, 4] == pytest.approx(0.25 * t, rel=0.02)
    assert not np.nan_to_num(thick[:, 8:17]).any()
    # held by the rim at its other end, which is no free surface
    assert not np.nan_to_num(thick[:, : own_decks.RIM]).any()


def test_effects_on_a_deck_have_exact_slopes(case: LoadedCase) -> None:
    """A part's thickness moves nodes, rubber's stiffness in vibration its Prony series."""
    evaluator = Evaluator(TyreDesign(case))
    names = [f"effects.{id}" for id in AS_DECK]
    start = dict(zip(names, AS_DECK.values(), strict=True))
    hertz = lambda values: np.array(
        [m.frequency_Hz for m in evaluator.evaluate(Question(values)).modes]
    )
    slopes = evaluator.evaluate(Question(start, tuple(names))).gradients
    for name in names:
        up, down = (hertz({**start, name: start[name] + side * 1e-4}) for side in (1, -1))
        assert slopes[name] == pytest.approx((up - down) / 2e-4, rel=1e-4, abs=1e-4)


def test_dynamic_stiffening_leaves_the_inflated_state(case: LoadedCase) -> None:
    """And is the same as twice all shear constants of the vibration: the tangent grows, by less
    than all of it."""
    evaluator = Evaluator(TyreDesign(case))
    plain, stiff = (
        evaluator.evaluate(Question({"effects.dynamic_stiffening": e})) for e in (0.0, 1.0)
    )
    both = plain.modes, stiff.modes
    ratio = np.array([b.frequency_Hz / a.frequency_Hz for a, b in zip(*both, strict=True)])
    assert (ratio > 1.01).all() and (ratio < np.sqrt(2)).all()
    assert stiff.mass_kg == plain.mass_kg


def test_what_a_deck_cannot_have_is_refused_by_name(case: LoadedCase) -> None:
    for id, words in (
        ("cap_ply", "changes lines or regions of a section or a law"),
        ("frequency_stiffening", "changes lines or regions of a section or a law"),
        ("belt_width", "changes lines or regions of a section or a law"),
    ):
        with pytest.raises(ValueError, match=rf"effects.{id} {words}"):
            resolved(with_values(case, {f"effects.{id}": catalogue()[id].high}))
    bare = with_values(case, {})
    assert bare.case.deck
    deck = bare.case.deck.model_copy(update={"parts": {"tread": ["BODY"]}})
    object.__setattr__(bare.case, "deck", deck)
    with pytest.raises(ValueError, match="needs a free outer surface"):
        resolved(with_values(bare, {"effects.tread_wear": 0.1}))
    gauges = deck.gauges.model_copy(update={"tread": 1.05})
    parts = {"tread": ["NOBODY"]}
    deck = deck.model_copy(update={"parts": parts, "gauges": gauges})
    with pytest.raises(InputError, match="NOBODY is none of "):
        case.kind.deck.flat({}, deck.thickened)


@pytest.mark.slow
def test_an_effect_withheld_from_a_deck_is_named(case: LoadedCase, tmp_path: Path) -> None:
    """A tyre drawn with an effect has that effect named; effects for which a deck has no numbers
    are reported with the reason."""
    evaluator, noise = Evaluator(TyreDesign(case)), np.random.default_rng(1)
    rows = ["quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma"]
    for kPa in (160.0, 240.0):
        drawn = {"effects.sidewall_gauge": 0.12, "A_CORD": 4e-7, "pressure_kPa": kPa}
        evaluation = evaluator.evaluate(Question(drawn))
        for mode in paired_labels(evaluation.modes):
            c, m, kind = mode.label.c, mode.label.m, mode.label.kind or ""
            f = mode.frequency_Hz * (1 + 5e-4 * noise.standard_normal())
            rows += [f"frequency_Hz,{c},{m},{kind},,{kPa},0,{f!r},{5e-4 * f!r}"] * (m < 2)
    rows.append(f"mass_kg,,,,,240,0,{evaluation.mass_kg!r},0.01")
    measured = tmp_path / "measured.csv"
    measured.write_text("\n".join(rows) + "\n")
    of_all = [f"material {name} / HYPERELASTIC / C10" for name in ("TREAD", "SIDEWALL", "BODY")]
    own = YAML(typ="safe").load(case.path)
    own["variables"]["C10_BODY"]["sets"] = of_all
    own["variables"] = {name: own["variables"][name] for name in ("A_CORD", "C10_BODY")}
    path = case.path.with_name("one_rubber.yaml")
    path.write_text(json.dumps(own))
    effects = ["sidewall_gauge", "bead_filler", "cap_ply"]
    words = [word for id in effects for word in ("--effect", id)]
    out = ["--output", str(tmp_path / "out"), "--no-store", "--quiet", "--no-pictures"]
    with pytest.raises(SystemExit) as ended:
        main(["diagnose", str(path), "--measured", str(measured), *words, *out])
    assert not ended.value.code
    diagnosis = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert diagnosis["verdict"] == "named" and diagnosis["effect"] == "sidewall_gauge"
    page = (tmp_path / "out" / "diagnosis.md").read_text()
    assert "Not considered, changes lines or regions of a section or a law" in page
    assert {part["region"] for part in diagnosis["section_map"]} == {
        "TREAD",
        "SIDEWALL",
        "BODY",
        "CORD",
    }
