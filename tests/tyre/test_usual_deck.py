"""Slips of units in a user's deck are refused at every door, with what was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from tyrecal.tyre.load import load_case, validate
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.text import OwnDeckError
from tyrecal.tyre.usual_deck import deck_slips, unusual_numbers, usual_numbers
from tyrecal.tyre.values import unusual_value

from ..cli.test_cli import run
from . import maker_decks
from .own_decks import STYLES as OTHER_STYLES
from .own_decks import plain
from .test_membranes import maker, recorded

STYLES = {"plain": plain, **OTHER_STYLES}


@pytest.mark.parametrize("style", STYLES)
def test_no_number_of_a_deck_as_it_is_is_unusual(style: str, tmp_path: Path) -> None:
    path = tmp_path / "tyre.inp"
    path.write_text(STYLES[style]())
    deck = read_own_deck(path)
    assert list(deck_slips(deck, deck.numbers)) == []


@pytest.mark.parametrize(
    ("style", "path", "value", "meant"),
    [
        ("plain", "material CORD / ELASTIC / E", 1e4, "10000 MPa, 1e+10 Pa"),
        ("plain", "material RUBBER / HYPERELASTIC / C10", 0.8, "0.8 MPa, 8e+05 Pa"),
        ("plain", "material RUBBER / HYPERELASTIC / D1", 0.05, "0.05 1/MPa, 5e-08 1/Pa"),
        ("plain", "material RUBBER / DENSITY / density", 1.1, "1.1 g/cm³, 1100 kg/m³"),
        ("plain", "rebar BELT_1 / spacing", 1.16, "1.16 mm, 0.00116 m"),
        ("plain", "rebar BELT_1 / area", 0.21, "0.21 mm², 2.1e-07 m²"),
        ("millimetres", "material CORD / ELASTIC / E", 1e10, "1e+10 Pa, 1e+04 MPa"),
        ("millimetres", "material CORD / DENSITY / density", 1500.0, "1500 kg/m³, 1.5e-09 t/mm³"),
        ("millimetres", "rebar BELT_1 / spacing", 0.00116, "0.00116 m, 1.16 mm"),
    ],
)
def test_a_slip_is_refused_with_what_was_meant(
    style: str, path: str, value: float, meant: str, tmp_path: Path
) -> None:
    file = tmp_path / "tyre.inp"
    file.write_text(STYLES[style]())
    deck = read_own_deck(file)
    assert path in usual_numbers(deck, deck.flat({})), sorted(deck.numbers)
    ((_, message),) = unusual_numbers(deck, {path: value})
    assert f"did you mean {meant}" in message


@pytest.mark.parametrize(
    ("edits", "path", "words"),
    [
        (
            [("800000.0, 200000.0", "1e3, 0.0")],
            "material RUBBER / HYPERELASTIC / C10",
            "usual is 300000 to 4.75e+06 Pa, for a shear modulus of 0.6 to 9.5 MPa",
        ),
        (
            [("800000.0, 200000.0", "-1.5e5, 200000.0")],
            "material RUBBER / HYPERELASTIC / C10",
            "usual is 100000 to 4.55e+06 Pa, for a shear modulus of 0.6 to 9.5 MPa",
        ),
        (
            [("MOONEY-RIVLIN", "OGDEN"), ("800000.0, 200000.0", "2000.0, 2.0")],
            "material RUBBER / HYPERELASTIC / mu1",
            "did you mean 2000 kPa, 2e+06 Pa",
        ),
        (
            [("1100.0", "7850.0")],
            "material RUBBER / DENSITY / density",
            "usual is 700 to 2500 kg/m³ of rubber",
        ),
        (
            [("1500.0\n", "7850.0\n"), ("10000000000.0", "190e6")],
            "material CORD / ELASTIC / E",
            "of steel, by its density; did you mean 1.9e+08 kPa, 1.9e+11 Pa",
        ),
        ([("10000000000.0", "2e8")], "material CORD / ELASTIC / E", "2.8e+09 to 7.1e+10 Pa"),
        (
            [("00.0, 0.3\n", "00.0, 0.0003\n")],
            "material CORD / ELASTIC / nu",
            "usual is 0, or 0.05 to 0.5",
        ),
        (
            [("0.3, 0.0, 0.1\n", "0.0003, 0.0, 0.1\n")],
            "material RUBBER / VISCOELASTIC / g",
            "usual is 0, or 0.005 to 0.95 of the largest term",
        ),
        (
            [("0.3, 0.0, 0.1\n", "0.3, 0.0, 0.0001\n0.002, 0.0, 0.00001\n")],
            "material RUBBER / VISCOELASTIC / row 1 / tau",
            "usual is 0.001 to 100000 s of the slowest term",
        ),
        (
            [("10000000000.0", "1e11")],
            "material CORD / ELASTIC / E",
            "for layers of 500 to 30000 N/mm (modulus times area over spacing)",
        ),
        (
            [
                ("MOONEY-RIVLIN", "POLYNOMIAL, N=2"),
                ("800000.0, 200000.0, 5e-08", "8e5, 2e5, 2e7, 0., 0., 5e-8, 0."),
            ],
            "material RUBBER / HYPERELASTIC / C20",
            "-1e+07 to 1e+07 Pa, 10 times the first",
        ),
        (
            [("800000.0, 200000.0", "8e6, 200000.0")],
            "material RUBBER / HYPERELASTIC / C10",
            "usual is 100000 to 4.55e+06 Pa",
        ),
        ([("4.2E-07, 0.001", "4.2E-06, 0.001")], "rebar CARCASS / area", "for cords every 1 mm"),
        ([("4.2E-07, 0.001", "4.2E-07, 0.01")], "rebar CARCASS / area", "for cords every 10 mm"),
        ([("BELT_1, 2.1e-7", "BELT_1, 2.1e-6")], "rebar BELT_1 / area", "cords every 1.16 mm"),
        ([(", 110.0", ", 70.0")], "rebar BELT_2 / angle", "did you mean 110 degrees"),
        ([(", 70.0", ", 20.0")], "rebar BELT_1 / angle", "20 degrees from the circumference"),
        ([(", 70.0", ", 0.07")], "rebar BELT_1 / angle", "usual is 25 to 155"),
        ([("CORD, 0.0", "CORD, 90.0")], "rebar CARCASS / angle", "usual is -30 to 30"),
    ],
)
def test_numbers_that_do_not_go_together_are_refused(
    edits: list[tuple[str, str]], path: str, words: str, tmp_path: Path
) -> None:
    """By the law of the rubber, the density of the cords and the place of a layer."""
    text = plain()
    for old, new in edits:
        assert text.count(old) == 1
        text = text.replace(old, new)
    (tmp_path / "tyre.inp").write_text(text)
    deck = read_own_deck(tmp_path / "tyre.inp")
    slips = {slip.key: slip.message for slip in deck_slips(deck, deck.numbers)}
    assert path in slips and words in slips[path], slips
    assert {key.rpartition(" / ")[0] for key in slips} == {path.rpartition(" / ")[0]}


@pytest.mark.parametrize(("thickness", "is_usual"), [(1e-6, True), (1e-3, True), (0.01, False)])
def test_the_thickness_of_membranes_is_judged(
    thickness: float, is_usual: bool, tmp_path: Path
) -> None:
    """Membranes that only bear cords are as thin as a micrometre."""
    (tmp_path / "tyre.inp").write_text(maker(thickness=thickness))
    deck = read_own_deck(tmp_path / "tyre.inp")
    slips = list(deck_slips(deck, deck.numbers))
    assert [slip.key for slip in slips] == [
        f"thickness of the membranes {name}" for name in (() if is_usual else ("CARCASS", "BELT"))
    ]
    assert all(slip.line and "usual is 1e-07 to 0.005 m" in slip.message for slip in slips)


def test_hyperelastic_cords_are_refused_as_cords_not_as_rubber(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = plain().replace("*ELASTIC\n10000000000.0, 0.3", "*HYPERELASTIC, NEO HOOKE\n1.7e9, 1e-11")
    (tmp_path / "tyre.inp").write_text(text.replace("1500.0\n", "7850.0\n"))
    assert run("init", "--deck", str(tmp_path / "tyre.inp"), "--no-pictures") == 2
    error = capsys.readouterr().err
    assert "is not *ELASTIC: give a cord its modulus" in error and "shear modulus" not in error


def test_every_door_refuses_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`init`, a command on a case whose deck was changed since, and --set; not with the option."""
    good, bad = tmp_path / "good.inp", tmp_path / "bad.inp"
    text = STYLES["plain"]()
    good.write_text(text)
    bad.write_text(text.replace("10000000000.0, 0.3", "10000, 0.3"))
    assert good.read_text() != bad.read_text()
    assert run("init", "--deck", str(bad), "--no-pictures") == 2
    assert "bad.inp, line" in capsys.readouterr().err and not (tmp_path / "bad.yaml").exists()
    assert run("init", "--deck", str(bad), "--no-pictures", "--allow-unusual") == 0
    assert run("init", "--deck", str(good), "--no-pictures") == 0
    case = load_case(tmp_path / "good.yaml")
    assert "did you mean 10000 MPa" in (
        unusual_value(case, "material CORD / ELASTIC / E", 1e4) or ""
    )
    good.write_text(bad.read_text())
    (mistake,) = validate(tmp_path / "good.yaml")
    assert mistake.file.endswith("good.inp") and mistake.line > 0
    assert validate(tmp_path / "good.yaml", allow_unusual=True) == []


@pytest.mark.parametrize("name", maker_decks.DECKS)
def test_no_number_of_a_maker_s_deck_is_unusual(name: str, tmp_path: Path) -> None:
    """Nor is the radius at which a spacing was measured, unless it is in another unit."""
    path = tmp_path / f"{name}.inp"
    path.write_text(recorded(name, tmp_path))
    deck = read_own_deck(path)
    assert list(deck_slips(deck, {})) == []
    if name == "half_section":
        radius = "rebar C01 / radius"
        ((path_of_slip, message),) = unusual_numbers(deck, {radius: 0.2})
        assert path_of_slip == radius and "did you mean 0.2 m, 200 mm?" in message


def test_numbers_by_marks_and_parameters_are_judged(tmp_path: Path) -> None:
    """At the line where the number acts, and by the name that gives it."""
    defined = "*PARAMETER\nshear = 2.0e3\nc10 = shear*0.4\n"
    text = defined + plain().replace("800000.0,", "<c10>,").replace("2.1e-7", "{{ A }}", 1)
    (tmp_path / "tyre.inp").write_text(text)
    deck = read_own_deck(tmp_path / "tyre.inp")
    slips = {slip.key: slip for slip in deck_slips(deck, {"A": 2.1e-4})}
    assert slips.keys() == {"material RUBBER / HYPERELASTIC / C10", "rebar BELT_1 / area"}
    line = text.splitlines().index("<c10>, 200000.0, 5e-08") + 1
    assert slips["material RUBBER / HYPERELASTIC / C10"].line == line
    assert slips["rebar BELT_1 / area"].value == "0.00021"
    names = {name for name, _ in unusual_numbers(deck, {"A": 2.1e-4})}
    assert names == slips.keys() | {"A", "parameter / shear"}


def test_a_tyre_of_metres_is_refused(tmp_path: Path) -> None:
    """A deck in millimetres that is read in metres has a radius of hundreds of metres."""
    file = tmp_path / "tyre.inp"
    file.write_text(STYLES["millimetres"]())
    deck = read_own_deck(file, "m")
    first = next(iter(deck_slips(deck, deck.numbers)))
    assert "radius of the outermost node is 337 m" in first.message


def test_an_angular_spacing_is_in_degrees_whatever_its_path(tmp_path: Path) -> None:
    """Also where two sections have a layer of one name, so that paths begin with the section."""
    file = tmp_path / "tyre.inp"
    text = plain().replace("BELT_1,", "BELT,").replace("BELT_2,", "BELT,")
    file.write_text(text.replace("*REBAR LAYER", "*REBAR LAYER, GEOMETRY=ANGULAR"))
    deck = read_own_deck(file)
    ranges = usual_numbers(deck, deck.flat({}))
    assert {each.unit for path, each in ranges.items() if path.endswith("spacing")} == {"degrees"}


def test_the_density_that_is_off_is_named(tmp_path: Path) -> None:
    """Where units are derived from the densities, and one of them fits none."""
    text = plain().replace("1500.0\n", "150000.0\n")
    (tmp_path / "tyre.inp").write_text(text)
    line = text.splitlines().index("150000.0")  # from 1, that of *DENSITY
    with pytest.raises(OwnDeckError, match=f"line {line}: .* cannot be inferred"):
        read_own_deck(tmp_path / "tyre.inp")
