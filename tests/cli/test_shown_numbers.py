"""Numbers, units and verdict sentences on the screens of commands; other wording is not pinned.

Numbers with units on the command line: the same number as without, and only units that fit.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tyrecal.cli.parameters import UNIT, unit_of
from tyrecal.errors import InputError
from tyrecal.measured.tables import read_measurements
from tyrecal.report import figure as figure_module
from tyrecal.units import UNITS_BY_DIMENSION, plain, read_number

from ..tyre import own_decks
from .test_cli import run
from .test_conventions import CASE, COARSE, commands
from .test_options import needed


def test_a_check_of_a_deck_prints_what_it_holds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The numbers are those that the deck of `own_decks` states."""
    path = tmp_path / "tyre.inp"
    path.write_text(own_decks.plain())
    assert run("deck", "--check", str(path)) == 0
    text = capsys.readouterr().out
    assert run("deck", "--check", str(path), "--json") == 0
    content = json.loads(capsys.readouterr().out)
    rim, crown, cavity = content["rim"], content["crown"], content["cavity"]
    for words in (
        "units m, kg, s, Pa; " + f"{content['mass_kg']:.2f} kg",
        f"{content['nodes']} nodes",
        f"holds {rim['nodes']} nodes, up to r = {1e3 * rim['radius_m']:.1f} mm",
        f"surface {cavity['surface']}, {cavity['faces']} faces, {content['pressure_kPa']:g} kPa",
        f"{2e3 * crown['half_width_m']:.1f} mm wide, radius {1e3 * crown['radius_m']:.1f} mm",
        "it has no rebar",
    ):
        assert words in text, words
    for ply in content["plies"]:
        spacing = f"{1e3 * ply['spacing_m']:.4g} mm" if "spacing_m" in ply else "degrees"
        area = f"{1e6 * ply['area_m2']:.4g} mm²"
        pattern = rf"ply {ply['name']} on {ply['set']}.*{area}.*{spacing}, {ply['angle_deg']:g} deg"
        assert re.search(pattern, text), pattern
    for section in content["sections"]:
        assert f"section {section['set']}: {section['material']} (" in text
    for name, value in content["numbers"].items():
        assert f"  {name} = {value:g}\n" in text


def test_a_picture_of_init_is_the_section_of_the_case(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both sides of it, from bead to crown, in mm, under its name; of a deck likewise."""
    drawn: list[tuple[Any, Path]] = []
    monkeypatch.setattr(figure_module, "save", lambda figure, path: drawn.append((figure, path)))
    monkeypatch.chdir(tmp_path)
    assert run("init", "205/60R15") == 0
    Path("tyre.inp").write_text(own_decks.plain())
    assert run("init", "--deck", "tyre.inp", "--figure-format", "svg") == 0
    assert run("init", "225/45R17", "--no-pictures") == 0
    assert [path.name for _, path in drawn] == ["205_60r15.png", "tyre.svg"]
    text = capsys.readouterr().out
    assert "section drawn in 205_60r15.png" in text and "section drawn in tyre.svg" in text
    axes = drawn[0][0].axes[0]
    assert drawn[0][0].get_suptitle().startswith("205/60R15")
    assert "outer diameter 627.0 mm, section width 208.6 mm" in axes.get_title()
    points = [p.vertices for c in axes.collections for p in c.get_paths() if len(p.vertices)]
    lowest = min(each.min(0)[0] for each in points), min(each.min(0)[1] for each in points)
    highest = max(each.max(0)[0] for each in points), max(each.max(0)[1] for each in points)
    assert highest == pytest.approx((104.3, 313.5), abs=0.1)
    assert lowest == pytest.approx((-104.3, 191.7), abs=0.5)


@pytest.mark.parametrize(
    ("option", "value", "sigma"),
    [
        (["--sigma-percent", "0.5"], 66.0, 0.33),
        (["--sigma-percent", "0.5", "--floor-percent", "2"], 66.0, 1.32),
    ],
)
def test_options_of_import_reach_the_numbers(
    option: list[str], value: float, sigma: float, tmp_path: Path
) -> None:
    """The one mode of the table is [2,1] at 66 Hz, without a sigma."""
    table, out = tmp_path / "t.csv", tmp_path / "m.csv"
    table.write_text('mode,frequency_Hz\n"[2,1]",66.0\n')
    given = ["--pressure-kPa", "200", *option, "--output", str(out), "--no-pictures"]
    assert run("measured", "import", str(table), *given) == 0
    (row,) = read_measurements(out)
    assert (row.value, row.pressure_kPa) == (value, 200.0)
    assert row.sigma == pytest.approx(sigma)


FIRST = {  # a kg counts as a mass, though a load may be given in it; 1/s would be part of a number
    unit: name
    for name, units in reversed(UNITS_BY_DIMENSION.items())
    for unit in units
    if not unit.startswith("1/")
}
UNITS = [(name, unit) for unit, name in FIRST.items()]
OPTIONS = [
    (name, option)
    for name, command in commands().items()
    for option in command.params
    if isinstance(option, click.Option) and unit_of(option) in [unit for _, unit in UNITS]
]


@given(st.sampled_from(UNITS), st.floats(1e-6, 1e6), st.data())
def test_there_and_back(own: tuple[str, str], number: float, data: st.DataObject) -> None:
    """A number in another unit of its dimension, and that one in the first unit."""
    dimension, unit = own
    other = data.draw(st.sampled_from([unit for name, unit in UNITS if name == dimension]))
    there = read_number(f"{number!r}{unit}", other)
    assert read_number(f"{there!r} {other}", unit) == pytest.approx(number, rel=1e-10)
    assert read_number(repr(number), unit) == number


@given(st.sampled_from(UNITS), st.sampled_from([*UNITS_BY_DIMENSION]))
def test_a_unit_of_another_dimension(own: tuple[str, str], wanted: str) -> None:
    """It is refused with a number that would be right; kg and lb are loads as well as masses."""
    unit, *others = UNITS_BY_DIMENSION[wanted]
    if plain(own[1]) in map(plain, [unit, *others]):
        return
    with pytest.raises(InputError, match=r"unit.*: must be a number in ") as refused:
        read_number(f"2{own[1]}", unit)
    _, is_given, example = str(refused.value).rpartition(", or as ")
    assert not is_given or read_number(example, unit) > 0


@pytest.mark.parametrize(
    "text", ["", "bar", "2,4bar", "2.4.1bar", "2 4", "nan", "inf", "1e", "--2"]
)
def test_what_is_no_number(text: str) -> None:
    with pytest.raises(InputError):
        read_number(text, "kPa")


@pytest.mark.parametrize(("name", "option"), OPTIONS, ids=[f"{n} {o.opts[0]}" for n, o in OPTIONS])
def test_every_option_with_a_unit(
    name: str, option: click.Option, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It takes its own unit and the others of its dimension; a unit of time is refused by it."""
    command, unit = commands()[name], unit_of(option)
    units = next(each for each in UNITS_BY_DIMENSION.values() if unit in each)
    others = needed(command, tmp_path)

    def value(text: str) -> list[float]:
        got = command.make_context(name, [*others, option.opts[0], text]).params[option.name]
        if isinstance(got, str):  # a list, which the command itself reads
            assert unit in ("kPa", "N"), option.opts
            return [read_number(word, unit) for word in got.split(",")]
        return list(got) if option.multiple else [got]

    for other, factor in units.items():
        if other.startswith("1/"):
            continue
        size = 2.0 * units[unit] / factor
        assert value(f"{size!r}{other}") == pytest.approx([2.0]), other
    words = [*name.split(), *others, option.opts[0], "2s"]
    assert run(*words) == 2
    error = capsys.readouterr().err
    assert isinstance(option.type, click.types.StringParamType) or "must be a number in" in error


@pytest.mark.parametrize(
    ("words", "override"),
    [
        (["--pressure-kPa", "2.4bar"], {"pressure_kPa": 240.0}),
        (["--set", "pressure_kPa=2.4bar"], {"pressure_kPa": 240.0}),
        (["--set", "A_belt=0.26mm2"], {"A_belt": 2.6e-7}),
        (["--set", "C10=1.1MPa"], {"C10": 1.1e6}),
        (["--set", "rebar_layers.belt_1.angle_deg=1.2rad"], {}),
        (["--set", "effects.rim_width=-10mm"], {"effects.rim_width": -0.01}),
    ],
)
def test_settings(words: list[str], override: dict[str, float], tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("modes", CASE, *COARSE, *words, "--output", str(out), "--quiet") == 0
    overrides = json.loads((out / "modes.json").read_text())["provenance"]["overrides"]
    assert override.items() <= overrides.items() and len(overrides) == 1


@pytest.mark.parametrize(
    ("words", "refused"),
    [
        (["modes", CASE, "--set", "pressure_kPa=4kN"], "4kN': kN is a unit of load: must be"),
        (["modes", CASE, "--set", "A_belt=3mm"], "mm is a unit of length: must be a number in m²"),
        (["modes", CASE, "--set", "C10=3furlong"], "there is no unit 'furlong'"),
        (["modes", CASE, "--set", "mesh.levels.coarse=3mm"], "3mm"),
        (["footprint", CASE, "--loads-N", "3kN,2bar"], "must be numbers in N, as in 3000,5000"),
        (["sweep", CASE, "pressure_kPa=1.6bar:3mm:3"], "mm is a unit of length"),
        (["effects", "rim_width", "--case", CASE, "--value", "3bar"], "must be a number in m, or"),
    ],
)
def test_a_wrong_dimension_in_words(
    words: list[str], refused: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*words) == 2
    assert refused in capsys.readouterr().err


def test_a_sweep_from_bar_to_psi(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["sweep", CASE, *COARSE, "--json", "--no-pictures", "--output", str(tmp_path / "out")]
    assert run(*words, "pressure_kPa=1.6bar:36psi:2") == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [row["values"]["pressure_kPa"] for row in rows] == [160.0, pytest.approx(248.2113)]


def test_the_pattern_of_an_option() -> None:
    assert UNIT.search("--rim-width-in") and not UNIT.search("--latin-hypercube")
