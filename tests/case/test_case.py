"""The shipped cases load; their numbers can be set; every mistake is told in one go.

Wrong cases are refused in sentences that name what is wrong.

The schema by which editors check a case accepts shipped cases, and sees slips of keys.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML

from tyrecal.errors import InputError
from tyrecal.tyre.case import CaseError, number_at, parse_assignment, parse_setting, start_values
from tyrecal.tyre.case.checks import find
from tyrecal.tyre.case.editor import EDITOR_LINE, SCHEMA_FILE, case_schema, with_editor_line
from tyrecal.tyre.load import load_case, validate
from tyrecal.tyre.values import with_values

from ..cli.test_cli import run
from ..conftest import CASES
from .bad_cases import BAD, CSV, GOOD, TABLE, write

P235 = load_case(CASES / "p235_75r17.yaml")


def put(folder: Path, *edits: tuple[str, str]) -> Path:
    content = GOOD
    for old, new in edits:
        assert old in content
        content = content.replace(old, new, 1)
    (folder / CSV).write_text(TABLE)
    path = folder / "case.yaml"
    path.write_text(content)
    return path


@pytest.mark.parametrize("name", ["p235_75r17", "p235_75r17_narrow_rim"])
def test_shipped_cases_are_right(name: str) -> None:
    path = CASES / f"{name}.yaml"
    assert validate(path) == []
    assert load_case(str(path)).case.size == "P235/75R17"


def test_values_and_defaults() -> None:
    case = P235.case
    assert case.pressure_kPa == 240
    assert case.materials["rubber"].kind == "rubber"
    assert case.materials["belt_cord"].density_kg_per_m3 == 5900
    assert case.rebar_layers["belt_2"].angle_deg == 110
    assert case.rebar_layers["belt_2"].geometry == "constant"
    assert case.mesh.levels["default"].rows == [1, 1, 1, 3]
    assert case.mesh.hourglass_stiffness_Pa is None and case.templates is None
    assert len(case.targets.modes) == 9 and case.targets.modes[0].weight == 1
    assert P235.section.names == ("inner", "ply", "belt1", "belt2", "outer")
    assert P235.folder == CASES and P235.file_data["rim"]["reference_point_m"] == {"r": 0, "z": 0}


def test_a_case_without_targets_and_variables(tmp_path: Path) -> None:
    content = GOOD[: GOOD.index("variables:")] + GOOD[GOOD.index("solver:") :]
    path = put(tmp_path)
    path.write_text(content)
    case = load_case(path).case
    assert case.targets.modes == [] and case.variables == {}


def test_angular_cords_templates_and_linear_variables(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    angle = "  angle: {sets: [rebar_layers.belt_1.angle_deg], start: -110, lower: -120, upper: 0,"
    path = put(
        tmp_path,
        ("spacing_m: 1.0e-3", "geometry: angular, spacing_deg: 0.15"),
        ("rebar_layers.carcass.spacing_m", "rebar_layers.carcass.spacing_deg"),
        ("targets:", angle + " scale: linear}\ntargets:"),
        ("solver:", "templates: mine\nsolver:"),
    )
    loaded = load_case(path)
    assert loaded.case.rebar_layers["carcass"].spacing_deg == 0.15
    assert with_values(loaded, {"angle": -60}).case.rebar_layers["belt_1"].angle_deg == -60


def test_one_wrong_key_of_a_part_hides_no_other(tmp_path: Path) -> None:
    """Keys of a part that must agree are checked even where another of its keys is wrong."""
    path = put(
        tmp_path,
        ("stations: p235_75r17.csv", "stations: p235_75r17.csv\n  outline: {file: 7}"),
        ("{r: 0.0, z: 0.0}", "{r: 0.1, z: 0.0}\n  free: true\n  mass_kg: heavy"),
    )
    keys = {mistake.key for mistake in validate(path)}
    assert {"section.outline.file", "section.outline"} <= keys
    assert {"rim.mass_kg", "rim.reference_point_m"} <= keys


def test_every_mistake_in_one_go_with_its_line(tmp_path: Path) -> None:
    path = put(
        tmp_path,
        ("pressure_kPa: 240.0", "pressure_kPa: wide"),
        ("1100.0", "-1100.0"),
        ("material: belt_cord", "material: steel"),
        ("upper: 1.0e+7", "upper: 1.0e+4"),
        ("level: default\n", "level: finest\n"),
        ("{c: 1, m: 0,", "{c: 1, m: 1,"),
        ("sectors: 60", "sector: 60"),
    )
    table = TABLE.splitlines()
    table[4] = table[4][:-1] + "7"
    (tmp_path / CSV).write_text("\n".join(table))
    with pytest.raises(CaseError) as error:
        load_case(path)
    mistakes = error.value.mistakes
    assert mistakes == validate(path)
    lines = path.read_text().splitlines()
    here = [m for m in mistakes if m.file == str(path)]
    assert [m.line for m in here] == sorted(m.line for m in here)
    assert {m.key for m in here} == {
        "pressure_kPa",
        "mesh.level",
        "materials.rubber.density_kg_per_m3",
        "rebar_layers.belt_1.material",
        "variables.C10.upper",
        "targets.modes.3",
        "analysis.sector",
    }
    for mistake in here:
        if not mistake.key.endswith("3"):
            assert mistake.value in lines[mistake.line - 1]
    (there,) = [m for m in mistakes if m.file != str(path)]
    assert (there.file, there.line) == (str(tmp_path / CSV), 5)
    assert str(here[0]) == f"{path}, line 6: pressure_kPa is wide: must be a number"


def test_start_values_and_with_values() -> None:
    start = start_values(P235)
    assert start == {"A_belt": 2.118683e-7, "A_carcass": 4.208352e-7, "C10": 1e6}
    new = with_values(P235, {"A_belt": 3e-7, "mesh.levels.default.rows.0": 2, "pressure_kPa": 200})
    assert new.case.rebar_layers["belt_1"].area_m2 == new.case.rebar_layers["belt_2"].area_m2
    assert new.case.rebar_layers["belt_2"].area_m2 == 3e-7 and new.case.pressure_kPa == 200
    assert new.case.mesh.levels["default"].rows == [2, 1, 1, 3]
    assert new.file_data == P235.file_data  # as the file has it
    # the old one is as it was
    assert P235.case.rebar_layers["belt_1"].area_m2 == 2.118683e-7
    assert P235.file_data["pressure_kPa"] == 240 and P235.case.mesh.levels["default"].rows[0] == 1


def test_optional_numbers_can_be_set() -> None:
    values = {"analysis.vibration_frequency_Hz": 60.0, "mesh.hourglass_stiffness_Pa": 3e4}
    new = with_values(P235, values)
    assert new.case.analysis.vibration_frequency_Hz == 60
    assert new.case.mesh.hourglass_stiffness_Pa == 3e4


@pytest.mark.parametrize(
    "number",
    [
        "rim.mass_kg",
        "rim.spindle.tilt_rad_per_N_m",
        "cavity.share",
        "road.friction",
        "materials.rubber.frequency_exponent",
    ],
)
def test_a_number_that_is_not_written_can_vary(number: str, tmp_path: Path) -> None:
    variable = f"variables:\n  x: {{sets: [{number}], start: 0.1, lower: 0.01, upper: 0.4}}\n"
    loaded = load_case(put(tmp_path, ("\nvariables:", "\n" + variable.rstrip())))
    with pytest.raises(KeyError):
        find(loaded.file_data, number)
    moved = with_values(loaded, {"x": 0.2})
    assert number_at(moved, number) == 0.2


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("sets: [analysis.vibration_frequency_Hz]", "has no value, and no default"),
        ("sets: [rim.masskg]", "did you mean 'mass_kg'"),
        ("sets: [analysis.sectors]", "whole number"),
        ("sets: [rim.free]", "leads to no number"),
        ("sets: [rim.mass_kg, cavity.temperature_C]", "cavity.temperature_C must be less than 300"),
    ],
)
def test_but_it_must_be_a_number(line: str, words: str, tmp_path: Path) -> None:
    variable = f"variables:\n  x: {{{line}, start: 1, lower: 0.5, upper: 400}}\n"
    (mistake,) = validate(put(tmp_path, ("\nvariables:", "\n" + variable.rstrip())))
    assert words in str(mistake)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"C1": 1.0}, "did you mean 'C10'"),
        ({"materials.rubber.C10": 1.0}, "did you mean 'C10_Pa'"),
        ({"materials.rubber.density_kg_per_m3": -1.0}, "must be greater than 0, got -1"),
        ({"C10": float("nan")}, "finite"),
        ({"C10": True}, "must be a number"),
        ({"C10": "1"}, "must be a number"),
        ({"C10": 1e6, "materials.rubber.C10_Pa": 2e6}, "set twice"),
        ({"name": 1.0}, "name is text, 'P235/75R17"),
        ({"materials": 1.0, "C10": 1e6}, "not a number"),
        ({"mesh.levels.default.rows.0": 1.5}, "whole number"),
        ({"mesh.levels.default.rows.9": 1}, "there is no '9'"),
        ({"targets.modes.8.c": 3}, "a target already"),
        ({"variables.C10.start": 1e9}, "at most upper"),
        ({"rebar_layers.belt_1.spacing_deg": 1}, "must be absent"),
    ],
)
def test_with_values_refuses(values: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words) as error:
        with_values(P235, values)
    assert "\n" not in str(error.value)


def test_with_values_is_fast() -> None:
    start = start_values(P235)
    durations = []
    for _ in range(50):
        began = time.process_time()
        with_values(P235, start)
        durations.append(time.process_time() - began)
    assert min(durations) < 1e-3


def test_parse_assignment() -> None:
    assert parse_assignment("C10=1.2e6") == ("C10", 1.2e6)
    assert parse_setting("rim.free=true") == ("rim.free", True)
    assert parse_setting("a.b=null") == ("a.b", None)
    assert parse_setting("rim.holds = bead_surface") == ("rim.holds", "bead_surface")
    for text in ("C10", "=3", "C10=", "C10=high", "C10=null", "C10=1e", "C10=nan", "C10=inf"):
        with pytest.raises(ValueError, match="must be"):
            parse_assignment(text)


def test_a_wrong_path_is_a_users_mistake() -> None:
    """A study from outside may ask for any path: its command ends with a sentence."""
    with pytest.raises(InputError, match="nothing"):
        number_at(load_case(CASES / "p235_75r17.yaml"), "nothing")


def test_the_table_is_long_enough() -> None:
    assert len(BAD) >= 60


@pytest.mark.parametrize("name", BAD)
def test_wrong_case(name: str, tmp_path: Path) -> None:
    path = write(name, tmp_path)
    before = {file: file.read_bytes() for file in tmp_path.iterdir()}
    mistakes = validate(path)
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == before
    listing = "\n".join(map(str, mistakes))
    assert any(m.key == BAD[name].key and BAD[name].words in m.message for m in mistakes), listing
    for mistake in mistakes:
        assert str(mistake).isprintable() and len(mistake.message) < 400
        exists = path.is_file()  # else no line is to blame
        assert mistake.line >= exists and mistake.file.startswith(str(tmp_path))


VALIDATOR = jsonschema.Draft202012Validator(json.loads(case_schema()))


def content(path: Path) -> dict[str, Any]:
    """A case as an editor reads it."""
    return YAML(typ="safe").load(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", [*CASES.glob("*.yaml"), CASES / "ring_3d/ring.yaml"])
def test_shipped_cases_are_accepted(path: Path) -> None:
    VALIDATOR.validate(content(path))


@pytest.mark.parametrize(
    "slip",
    [
        {"presure_kPa": 240.0},
        {"pressure_kPa": "240"},
        {"pressure_kPa": 2000.0},
        {"road": {"wheel": "hold"}},
        {"analysis": {"highest_harmonic": 21}},
        {"road": {"elastic_slip_m": 0.0}},
        {"materials": {"rubber": {"kind": "rubber", "C10_Pa": 1e6}}},
    ],
)
def test_slips_are_seen(slip: dict[str, Any]) -> None:
    assert not VALIDATOR.is_valid(content(CASES / "p235_75r17.yaml") | slip)


def test_every_key_is_explained() -> None:
    schema = json.loads(case_schema())
    parts = [schema, *schema["$defs"].values()]
    keys = [entry for part in parts for entry in part["properties"].values()]
    assert len(keys) > 120 and all(entry["description"] for entry in keys)
    assert "title" not in schema


def test_a_written_case_names_the_schema_next_to_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("init", "205/60R15", "--no-pictures", "--quiet") == 0
    assert run("diagnose", "205_60r15.yaml", "--add", "cap_ply=1e6", "--quiet") == 0
    for name in ("205_60r15.yaml", "205_60r15_cap_ply.yaml"):
        assert (tmp_path / name).read_text(encoding="utf-8").count(EDITOR_LINE) == 1
        VALIDATOR.validate(content(tmp_path / name))
    assert (tmp_path / SCHEMA_FILE).read_text(encoding="utf-8") == case_schema()


def test_the_line_comes_once() -> None:
    assert with_editor_line(with_editor_line("format: 1\n")) == EDITOR_LINE + "format: 1\n"
    dos = (EDITOR_LINE + "format: 1\n").replace("\n", "\r\n")
    assert with_editor_line(dos) == dos
