"""Numbers with units on the command line: the same number as without, and only units that fit."""

from __future__ import annotations

import json
from pathlib import Path

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tyrecal.cli.parameters import UNIT, unit_of
from tyrecal.errors import InputError
from tyrecal.units import UNITS_BY_DIMENSION, plain, read_number

from .test_cli import run
from .test_conventions import CASE, COARSE, commands
from .test_options import needed

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
