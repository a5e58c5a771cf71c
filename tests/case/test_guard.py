"""Slips of unit are refused with what was probably meant, and taken as they are where allowed."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from tyrecal.cli.main import cli
from tyrecal.tyre.case.shape import with_defaults
from tyrecal.tyre.load import load_case, validate
from tyrecal.tyre.usual import USUAL, refusal
from tyrecal.tyre.values import unusual_value

from .wrong import CASES, CSV, GOOD, PRESSURE, TABLE

BELT = "cord:\n    kind: cord\n    youngs_modulus_Pa: "
SLIPS = {  # name: text of the good case, text in its place, key, what was meant
    "bar": (PRESSURE, "pressure_kPa: 2.4", "pressure_kPa", "2.4 bar, 240 kPa"),
    "psi": (PRESSURE, "pressure_kPa: 35", "pressure_kPa", "35 psi, 241.3 kPa"),
    "MPa of pressure": (PRESSURE, "pressure_kPa: 0.24", "pressure_kPa", "0.24 MPa, 240 kPa"),
    "MPa of rubber": ("C10_Pa: 1.0e+6", "C10_Pa: 1.0", "materials.rubber.C10_Pa", "1 MPa, 1e+06"),
    "MPa of C01": ("C01_Pa: 0.0", "C01_Pa: 0.25", "materials.rubber.C01_Pa", "0.25 MPa, 2.5e+05"),
    "MPa of the start": (
        "start: 1.0e+6\n    lower: 1.0e+5",
        "start: 1.0\n    lower: 0.1",
        "variables.C10.start",
        "materials.rubber.C10_Pa: usual is 150000 to 2e+07 Pa",
    ),
    "kPa of rubber": (
        "C10_Pa: 1.0e+6",
        "C10_Pa: 1.0e+3",
        "materials.rubber.C10_Pa",
        "1000 kPa, 1e+06",
    ),
    "rubber as heavy as steel": (
        "density_kg_per_m3: 1100.0",
        "density_kg_per_m3: 7850.0",
        "materials.rubber.density_kg_per_m3",
        "usual is 700 to 2500 kg/m³ of rubber",
    ),
    "kPa of steel": (
        "172.2e+9",
        "172.2e+6",
        "materials.belt_cord.youngs_modulus_Pa",
        "of steel, by its density; did you mean 1.722e+08 kPa, 1.722e+11 Pa",
    ),
    "belt cords thicker than their spacing": (
        "belt_1: {line: belt1, material: belt_cord, area_m2: 2.118683e-7",
        "belt_1: {line: belt1, material: belt_cord, area_m2: 2.118683e-6",
        "rebar_layers.belt_1.area_m2",
        "usual is 4.22733e-08 to 1.52184e-06 m², for belt cords every 1.16 mm",
    ),
    "belts on one side": (
        "angle_deg: 110.0",
        "angle_deg: 70.0",
        "rebar_layers.belt_2.angle_deg",
        "usual are belts on both sides of the circumference, all 2 are on one; did you mean 110",
    ),
    "a carcass of a hundredth": (
        "9.87e+9",
        "9.87e+7",
        "materials.carcass_cord.youngs_modulus_Pa",
        "usual is 1.2e+09 to 7.1e+10 Pa, for layers of 500 to 30000 N/mm",
    ),
    "a Poisson's ratio by a thousand": (
        "poissons_ratio: 0.3",
        "poissons_ratio: 0.0003",
        "materials.belt_cord.poissons_ratio",
        "usual is 0, or 0.05 to 0.5",
    ),
    "a Prony share by a thousand": (
        "g: 0.3",
        "g: 0.0003",
        "materials.rubber.prony.0.g",
        "usual is 0, or 0.005 to 0.95 of the largest term",
    ),
    "a relaxation time by a thousand": (
        "tau_s: 0.1",
        "tau_s: 0.0001",
        "materials.rubber.prony.0.tau_s",
        "usual is 0.001 to 100000 s of the slowest term",
    ),
    "1/MPa": ("5.085e-8", "5.085e-2", "materials.rubber.D1_per_Pa", "0.05085 1/MPa, 5.085e-08"),
    "bulk modulus": ("5.085e-8", "3.9e7", "materials.rubber.D1_per_Pa", "bulk modulus K, D1 = 2/K"),
    "g/cm3": ("1100.0", "1.1", "materials.rubber.density_kg_per_m3", "1.1 g/cm³, 1100 kg/m³"),
    "t/mm3": ("5900.0", "5.9e-9", "materials.belt_cord.density_kg_per_m3", "t/mm³, 5900 kg/m³"),
    "GPa": ("172.2e+9", "172.2", "materials.belt_cord.youngs_modulus_Pa", "172.2 GPa, 1.722e+11"),
    "MPa of cords": (
        "9.87e+9",
        "9870",
        "materials.carcass_cord.youngs_modulus_Pa",
        "9870 MPa, 9.87e+09 Pa",
    ),
    "mm2": (
        "area_m2: 2.118683e-7",
        "area_m2: 0.2118683",
        "rebar_layers.belt_1.area_m2",
        "0.211868 mm², 2.119e-07 m²",
    ),
    "mm of spacing": (
        "spacing_m: 1.16e-3",
        "spacing_m: 1.16",
        "rebar_layers.belt_1.spacing_m",
        "1.16 mm, 0.00116 m",
    ),
    "cords counted": (
        "spacing_m: 1.16e-3",
        "spacing_m: 86",
        "rebar_layers.belt_1.spacing_m",
        "86 cords per decimetre, 0.001163 m",
    ),
    "carcass from the circumference": (
        "angle_deg: 0.0",
        "angle_deg: 90.0",
        "rebar_layers.carcass.angle_deg",
        "90 degrees from the circumference, 0 degrees from the meridian",
    ),
    "belt from the circumference": (
        "angle_deg: 70.0",
        "angle_deg: 20.0",
        "rebar_layers.belt_1.angle_deg",
        "20 degrees from the circumference, 70 degrees from the meridian",
    ),
    "radians": (
        "angle_deg: 70.0",
        "angle_deg: 1.2217",
        "rebar_layers.belt_1.angle_deg",
        "1.2217 rad, 70 degrees",
    ),
    "kN": ("solver:\n", "road: {loads_N: [4.5]}\nsolver:\n", "road.loads_N.0", "4.5 kN, 4500 N"),
    "a zero too many": (
        "solver:\n",
        "road: {loads_N: [40000]}\nsolver:\n",
        "road.loads_N.0",
        "34000 N, the load at which this tyre bottoms on its rim",
    ),
    "per cent of an effect": (
        "solver:\n",
        "effects: {bead_filler: 30}\nsolver:\n",
        "effects.bead_filler",
        "30 %, 0.3",
    ),
    "too wide a rim": (
        "solver:\n",
        "effects: {rim_width: 0.03}\nsolver:\n",
        "effects.rim_width",
        "usual is -0.0127 to 0.0127 m",
    ),
    "stiffness for compliance": (
        "solver:\n",
        "effects: {spindle_radial: 2.0e+7}\nsolver:\n",
        "effects.spindle_radial",
        "2e+07 N/m of stiffness, 5e-08 m/N",
    ),
    "mHz": ("79.5", "79500", "targets.modes.5.frequency_Hz", "79500 mHz, 79.5 Hz"),
    "kHz": ("79.5", "0.0795", "targets.modes.5.frequency_Hz", "0.0795 kHz, 79.5 Hz"),
    "sigma": ("79.5}", "79.5, sigma_Hz: 50}", "targets.modes.5.sigma_Hz", "to 15.9 Hz"),
    "cm2 of a patch": (
        "  modes:\n",
        "  footprint: [{load_N: 4000, contact_area_m2: 160, sigma_m2: 3}]\n  modes:\n",
        "targets.footprint.0.contact_area_m2",
        "160 cm², 0.016 m²",
    ),
    "mm of a patch": (
        "  modes:\n",
        "  footprint: [{load_N: 4000, contact_width_m: 141, sigma_m: 2}]\n  modes:\n",
        "targets.footprint.0.contact_width_m",
        "141 mm, 0.141 m",
    ),
    "mm of its sigma": (
        "  modes:\n",
        "  footprint: [{load_N: 4000, contact_length_m: 0.132, sigma_m: 2}]\n  modes:\n",
        "targets.footprint.0.sigma_m",
        "2 mm, 0.002 m",
    ),
    "N/mm": (
        "  modes:\n",
        "  footprint: [{load_N: 4000, vertical_stiffness_N_per_m: 220, "
        "sigma_N_per_m: 5}]\n  modes:\n",
        "targets.footprint.0.vertical_stiffness_N_per_m",
        "220 N/mm, 2.2e+05 N/m",
    ),
    "rpm": ("solver:\n", "spin_rad_per_s: 800\nsolver:\n", "spin_rad_per_s", "800 rpm, 83.78"),
    "K": (
        "solver:\n",
        "cavity: {temperature_C: 293.15}\nsolver:\n",
        "cavity.temperature_C",
        "293.15 K, 20 degrees Celsius",
    ),
    "g of mass": (
        "solver:\n",
        "point_mass: {mass_kg: 50}\nsolver:\n",
        "point_mass.mass_kg",
        "50 g, 0.05 kg",
    ),
    "mm of an uncertainty": (
        "absolute: 1.0e-3",
        "absolute: 1.0",
        "uncertainties.belt_width.absolute",
        "1 mm, 0.001 m",
    ),
}


def case(folder: Path, old: str, new: str) -> Path:
    assert old in GOOD, old
    (folder / CSV).write_text(TABLE)
    path = folder / "case.yaml"
    path.write_text(GOOD.replace(old, new, 1))
    return path


def test_there_are_enough_kinds() -> None:
    assert len(SLIPS) >= 25


@pytest.mark.parametrize("name", SLIPS)
def test_a_slip_of_unit_is_refused_unless_it_is_allowed(name: str, tmp_path: Path) -> None:
    old, new, key, words = SLIPS[name]
    path = case(tmp_path, old, new)
    (mistake,) = validate(path)
    assert mistake.key == key and words in mistake.message, mistake
    assert "--allow-unusual" in mistake.message
    assert str(mistake).startswith(f"{path}, line ") and f"{key} is " in str(mistake)
    assert validate(path, allow_unusual=True) == []
    refused = CliRunner().invoke(cli, ["modes", str(path)], standalone_mode=False)
    assert words in str(refused.exception)


def test_one_small_or_fast_term_of_a_prony_series_is_usual(tmp_path: Path) -> None:
    """Two terms that are small, or fast, are not."""
    old = "{g: 0.3, k: 0.0, tau_s: 0.1}"
    assert validate(case(tmp_path, old, f"{old}, {{g: 0.001, k: 0.0, tau_s: 1.0e-5}}")) == []
    both = "{g: 0.002, k: 0.0, tau_s: 1.0e-4}, {g: 0.001, k: 0.0, tau_s: 1.0e-5}"
    keys = [mistake.key for mistake in validate(case(tmp_path, old, both))]
    assert keys == ["materials.rubber.prony.0.g", "materials.rubber.prony.0.tau_s"]


SETTINGS = [  # arguments after the case, and what was meant
    (["modes", "--pressure-kPa", "2.4"], "--pressure-kPa 2.4: usual is 50 to 1200 kPa"),
    (["modes", "--set", "C10=1.0"], "--set C10=1: usual is"),
    (["modes", "--set", "materials.rubber.density_kg_per_m3=1.1"], "1.1 g/cm³, 1100 kg/m³"),
    (["modes", "--set", "rebar_layers.belt_1.angle_deg=110"], "did you mean 70 degrees"),
    (["modes", "--set", "materials.rubber.C01_Pa=-9e5"], "usual is -850000 to 1.9e+07 Pa"),
    (["modes", "--set", "C10=1e3"], "1000 kPa, 1e+06 Pa"),
    (["modes", "--load-N", "4"], "--load-N 4: usual is 100 to 34000 N"),
    (["modes", "--load-N", "400000"], "N, the load at which this tyre bottoms on its rim"),
    (["modes", "--sweep-load", "0,2,4"], "--sweep-load 2: usual is"),
    (["footprint", "--loads-N", "4,5"], "4 kN, 4000 N"),
    (["deck", "--loads-N", "4,5"], "4 kN, 4000 N"),
    (["sweep-pressure", "--from-kPa", "1.6", "--to-kPa", "3.2"], "1.6 bar, 160 kPa"),
    (["sweep-pressure", "--to-kPa", "1990"], "--to-kPa 1990: usual is 50 to 1200 kPa"),
    (["fit", "--set", "rebar_layers.carcass.angle_deg=90"], "from the circumference"),
    (["diagnose", "--add", "bead_filler=30"], "--add bead_filler=30: usual is 0 to 3"),
    (["effects", "cap_ply", "--value", "-5", "--case"], "--value -5: usual is 0 to 2e+06 N/m"),
    (["batch", "--from-kPa", "1.6"], "1.6 bar, 160 kPa"),
]


@pytest.mark.parametrize(("arguments", "words"), SETTINGS, ids=lambda each: str(each)[:40])
def test_what_stands_on_the_command_line_is_judged_too(
    arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command = [*arguments, str(CASES / "p235_75r17.yaml")]
    done = CliRunner().invoke(cli, command, standalone_mode=False)
    assert words in str(done.exception) and "--allow-unusual" in str(done.exception)
    assert not list(tmp_path.iterdir())  # before anything is made


INITS = [
    (["--pressure-kPa", "2.5"], "2.5 bar, 250 kPa"),
    (["--crown-mm", "0.012"], "0.012 m, 12 mm"),
    (["--rim-width-in", "205"], "205 mm, 8.071 inches"),
]


@pytest.mark.parametrize(("arguments", "words"), INITS)
def test_init_judges_its_numbers(
    arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli, ["init", "225/40R18", *arguments], standalone_mode=False)
    assert words in str(done.exception) and not list(tmp_path.iterdir())


def test_init_writes_an_unusual_case_where_it_is_allowed(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    command = ["init", "225/40R18", "--pressure-kPa", "40", "--output", str(path), "--no-pictures"]
    assert CliRunner().invoke(cli, [*command, "--allow-unusual"]).exit_code == 0
    assert [mistake.key for mistake in validate(path)] == ["pressure_kPa"]


SIZES = [
    "145/80R13",
    "205/60R15",
    "225/40R18",
    "315/35R21",
    "P235/75R17",
    "195/75R16C",
    "LT315/70R17",
    "31x10.50R15LT",
    "275/25R24",
]


@pytest.mark.parametrize("size", SIZES)
def test_cases_of_any_size_are_usual(size: str, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    command = ["init", size, "--output", str(path), "--no-pictures"]
    assert CliRunner().invoke(cli, command).exit_code == 0
    assert validate(path) == []


def test_usual_loads_follow_size_and_pressure() -> None:
    loaded = load_case(CASES / "p235_75r17.yaml")
    assert unusual_value(loaded, "road.loads_N.0", 20e3) is None
    assert unusual_value(loaded, "road.loads_N.0", 40e3)
    at_600 = {**loaded.file_data, "pressure_kPa": 600.0}
    assert refusal(at_600, loaded.section, ("road", "loads_N", 0), 40e3) is None
    assert refusal(at_600, loaded.section, ("road", "loads_N", 0), 61e3)


def test_every_range_is_of_a_number_that_a_case_can_have() -> None:
    """The ranges contain the numbers of the shipped cases and the schema's defaults."""
    reached = set()
    for path in CASES.glob("*.yaml"):
        loaded = load_case(path)
        data = with_defaults(loaded.file_data)
        for pattern in USUAL:
            words = pattern.split(".")
            entries = [((), data)]
            for word in words:
                entries = [
                    ((*keys, key), value)
                    for keys, part in entries
                    for key, value in (
                        part.items()
                        if isinstance(part, dict)
                        else enumerate(part)
                        if isinstance(part, list)
                        else ()
                    )
                    if word in ("*", key)
                ]
            for keys, value in entries:
                reached.add(pattern)
                if isinstance(value, float | int):
                    assert USUAL[pattern].holds(value), (keys, value)
    rest = {pattern for pattern in USUAL if pattern not in reached}
    assert {pattern.split(".")[1] for pattern in rest} <= {"outline", "footprint", "mass", "*"}, (
        rest
    )


def test_a_search_may_try_what_it_likes() -> None:
    """A range holds for what is stated; what evaluates designs is not told of it."""
    from tyrecal.tyre.values import with_values

    loaded = load_case(CASES / "p235_75r17.yaml")
    assert unusual_value(loaded, "C10", 5e2)
    assert with_values(loaded, {"C10": 5e2}).case.materials["rubber"].C10_Pa == 5e2  # type: ignore[union-attr]


HUGE = [
    ("79.5", "1.0e+300", "targets.modes.5.frequency_Hz"),
    ("79.5}", "79.5, sigma_Hz: 1.0e-300}", "targets.modes.5.sigma_Hz"),
    ("79.5}", "79.5, weight: 1.0e+300}", "targets.modes.5.weight"),
    ("tau_s: 0.1", "tau_s: 1.0e+308", "materials.rubber.prony.0.tau_s"),
    ("g: 0.3", "g: 0.9999999999", "materials.rubber.prony"),
    ("upper: 1.0e+7", "upper: 1.0e+308", "variables.C10.upper"),
    (PRESSURE, "pressure_kPa: 1.0e-300", "pressure_kPa"),
    ("solver:\n", "cavity: {share: 1.0e+9}\nsolver:\n", "cavity.share"),
    ("solver:\n", "road: {loads_N: [1.0e+300]}\nsolver:\n", "road.loads_N.0"),
    ("solver:\n", "road: {loads_N: [1.0e-9]}\nsolver:\n", "road.loads_N.0"),
    ("solver:\n", "effects: {spindle_radial: 1.0e+30}\nsolver:\n", "effects.spindle_radial"),
]


@pytest.mark.parametrize(("old", "new", "key"), HUGE)
def test_what_no_computer_holds_is_never_allowed(
    old: str, new: str, key: str, tmp_path: Path
) -> None:
    (mistake,) = validate(case(tmp_path, old, new), allow_unusual=True)
    assert mistake.key == key


@pytest.mark.parametrize(
    "setting",
    ["materials.rubber.density_kg_per_m3=1.1", "pressure_kPa=24", "effects.rim_width=0.02"],
)
def test_an_unusual_tyre_is_computed_where_it_is_allowed(setting: str, tmp_path: Path) -> None:
    command = ["modes", str(CASES / "p235_75r17.yaml"), "--mesh", "coarse", "--no-store", "--json"]
    command += ["--set", setting, "--output", str(tmp_path)]
    assert CliRunner().invoke(cli, command).exit_code == 2
    done = CliRunner().invoke(cli, [*command, "--allow-unusual"], standalone_mode=False)
    assert done.exit_code == 0 and done.return_value == 0, done.output
    assert (tmp_path / "modes.json").exists()


def test_targets_that_no_fit_can_use_are_told(tmp_path: Path) -> None:
    start = GOOD.index("    - {c: 1, m: 1, freq")
    end = GOOD.index("uncertainties:")
    path = case(tmp_path, GOOD[start:end], "\n")
    (mistake,) = validate(path)
    assert (mistake.key, mistake.value) == ("targets", "a table")
    assert "2 targets cannot determine 3 free variables" in mistake.message
    assert load_case(path).case.targets.weights == [1.0, 1.0]  # other studies do without
    weightless = GOOD[start:end].replace("}", ", weight: 0}")
    (mistake,) = validate(case(tmp_path, GOOD[start:end], weightless))
    assert "2 targets cannot determine" in mistake.message
