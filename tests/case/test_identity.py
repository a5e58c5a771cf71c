"""One hash for one tyre: all physics changes it, and nothing else does."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from tyrecal.errors import InputError
from tyrecal.studies.fitted import read_fitted
from tyrecal.tyre.case import LoadedCase, number_at, start_values, with_level
from tyrecal.tyre.case.identity import is_of_tyre, tyre_sha256
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..conftest import CASES

CASE, DRAWN = CASES / "p235_75r17.yaml", CASES / "205_60r15.yaml"
NOT_THE_TYRE = (
    "format",
    "pressure_kPa",
    "mesh",
    "analysis.static_increments",
    "analysis.sectors",
    "analysis.highest_harmonic",
    "analysis.modes_per_harmonic",
    "targets",
    "uncertainties",
    "solver",
    "road.",
    "variables",
)


@pytest.fixture(scope="module")
def case() -> LoadedCase:
    return load_case(CASE)


def numbers(data: Any, path: str = "") -> Iterator[str]:
    """Paths of all numbers in plain data."""
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in entries:
        here = f"{path}.{key}".removeprefix(".")
        if isinstance(value, dict | list):
            yield from numbers(value, here)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield here


def written(
    folder: Path, change: Callable[[dict[str, Any]], None], base: Path = CASE
) -> LoadedCase:
    """The case as another program would write it, changed."""
    yaml = YAML(typ="safe")
    data = yaml.load(base.read_text())
    change(data)
    with (folder / "case.yaml").open("w") as file:
        yaml.dump(data, file)
    (folder / "p235_75r17.csv").write_text((CASES / "p235_75r17.csv").read_text())
    return load_case(folder / "case.yaml")


def full(data: dict[str, Any]) -> None:
    """Put something beyond its default into every part of a tyre."""
    data["materials"]["rubber"] |= {"frequency_exponent": 0.05, "reference_frequency_Hz": 50.0}
    data["section"]["gauges"] = [{"between": ["belt2", "outer"], "factor": 1.1}]
    spindle = {
        "lateral_m_per_N": 1e-9,
        "radial_m_per_N": 2e-9,
        "torsional_rad_per_N_m": 3e-9,
        "tilt_rad_per_N_m": 4e-9,
    }
    data["rim"] |= {
        "mass_kg": 12.0,
        "polar_inertia_kg_m2": 0.4,
        "diametral_inertia_kg_m2": 0.3,
        "spindle": spindle,
    }
    data["cavity"] = {"temperature_C": 30.0, "share": 0.5}
    data["spin_rad_per_s"] = 1.0
    data["point_mass"] = {"mass_kg": 0.01, "z_m": 0.02}
    data["road_spring"] = {
        "radial_N_per_m": 1e4,
        "lateral_N_per_m": 2e4,
        "tangential_N_per_m": 3e4,
        "width_m": 0.09,
    }
    data["splice"] = {"share": 0.1, "width_deg": 12.0}
    data["effects"] = {"tread_wear": 0.1, "pressure_offset": 2.0}
    data["analysis"]["vibration_frequency_Hz"] = 60.0
    data["road"] = {"friction": 0.6, "loads_N": [1000.0]}
    data["targets"]["footprint"] = [{"load_N": 900.0, "contact_area_m2": 0.01, "sigma_m2": 1e-4}]


def test_every_number_of_physics_and_no_other(tmp_path: Path) -> None:
    case = written(tmp_path, full)
    plain = tyre_sha256(case)
    free = {path for variable in case.case.variables.values() for path in variable.sets}
    physics = 0
    for path in numbers(case.file_data):
        if path == "format" or path.endswith((".c", ".m")):
            continue  # the case would be wrong
        old = number_at(case, path)
        new = old + 1 if isinstance(old, int) else old * 1.001 or 1e-3
        if path == "rim.reference_point_m.r":
            other = written(tmp_path, at_a_radius)
            assert tyre_sha256(other) != tyre_sha256(written(tmp_path, lambda data: None))
            continue
        other = with_values(case, {path: new})
        assert number_at(other, path) != old
        apart = path.startswith(NOT_THE_TYRE) or path in free
        assert (tyre_sha256(other) == plain) == apart, path
        assert is_of_tyre(path) == (not apart or path in free), path
        physics += not apart
    assert physics > 40


def at_a_radius(data: dict[str, Any]) -> None:
    """Move the rim's reference point, which must stay on the axle where the rim moves."""
    data["rim"]["reference_point_m"]["r"] = 1e-3


def test_how_a_case_is_written_is_not_the_tyre(tmp_path: Path, case: LoadedCase) -> None:
    def change(data: dict[str, Any]) -> None:
        data |= {"name": "another", "size": "none", "pressure_kPa": 200}
        data["rebar_layers"] = dict(reversed(data["rebar_layers"].items()))
        data["rebar_layers"]["belt_1"] |= {"angle_deg": 70, "geometry": "constant"}
        data["materials"]["rubber"]["frequency_exponent"] = 0
        data["section"]["gauges"] = []
        data["rim"] |= {"mass_kg": 15, "free": True, "spindle": {"lateral_m_per_N": 0}}
        data["effects"] = {"bead_filler": 0}
        data["cavity"] = {"gas": "air"}
        data["analysis"] |= {"sectors": 90, "static_increments": 5}
        del data["targets"], data["uncertainties"]
        for variable in data["variables"].values():
            variable |= {"scale": "linear", "start": variable["lower"] * 4}
        data["mesh"]["level"] = "coarse"
        data["solver"] = {"name": "calculix", "time_limit_s": 5, "options": {"element": "C3D8"}}

    assert tyre_sha256(written(tmp_path, change)) == tyre_sha256(case)
    table = tmp_path / "p235_75r17.csv"
    lines = table.read_text().splitlines()
    zeros = [line.replace(",0.00000,", ",-0e3,") for line in lines]
    assert zeros != lines
    (tmp_path / "renamed.csv").write_text("\n".join(zeros) + "\n")

    def renamed(data: dict[str, Any]) -> None:
        data["section"] = {"stations": "renamed.csv"}

    assert tyre_sha256(written(tmp_path, renamed)) == tyre_sha256(case)
    moved = tmp_path / "moved"
    moved.mkdir()
    written(moved, lambda data: None)
    (moved / "p235_75r17.csv").write_text(_nudged(lines))
    assert tyre_sha256(load_case(moved / "case.yaml")) != tyre_sha256(case)


def _nudged(lines: list[str]) -> str:
    """A station table with one of its numbers a thousandth of a millimetre larger."""
    cells = lines[2].split(",")
    place = next(i for i, name in enumerate(lines[0].split(",")) if name.endswith("r_mm"))
    cells[place] = repr(float(cells[place]) + 1e-3)
    return "\n".join([*lines[:2], ",".join(cells), *lines[3:]]) + "\n"


def test_what_varies_counts_by_name_and_path(tmp_path: Path, case: LoadedCase) -> None:
    plain = tyre_sha256(case)
    assert tyre_sha256(with_values(case, {"C10": 2e6, "A_belt": 3e-7})) == plain
    assert tyre_sha256(with_values(case, {"rebar_layers.belt_1.angle_deg": 70.07})) != plain

    def renamed(data: dict[str, Any]) -> None:
        data["variables"]["shear"] = data["variables"].pop("C10")

    def fewer(data: dict[str, Any]) -> None:
        del data["variables"]["A_belt"]["sets"][1]

    def held(data: dict[str, Any]) -> None:
        del data["variables"]["C10"]

    others = [tyre_sha256(written(tmp_path, change)) for change in (renamed, fewer, held)]
    assert len({plain, *others}) == 4

    def default(data: dict[str, Any]) -> None:
        data["variables"]["mass"] = {
            "sets": ["rim.mass_kg"],
            "start": 10.0,
            "lower": 5.0,
            "upper": 20.0,
        }

    def stated(data: dict[str, Any]) -> None:
        default(data)
        data["rim"]["mass_kg"] = 11.0

    assert tyre_sha256(written(tmp_path, default)) == tyre_sha256(written(tmp_path, stated))


@pytest.mark.parametrize("id", [*catalogue()])
def test_an_effect_of_0_is_absent(id: str, case: LoadedCase) -> None:
    effect = catalogue()[id]
    path = f"effects.{id}"
    present = with_values(case, {path: effect.high or effect.low})
    assert tyre_sha256(present) != tyre_sha256(case)
    assert tyre_sha256(with_values(present, {path: 0.0})) == tyre_sha256(case)


def test_an_effect_that_varies(tmp_path: Path) -> None:
    def free(data: dict[str, Any]) -> None:
        data["variables"]["filler"] = {
            "sets": ["effects.bead_filler"],
            "start": 1.0,
            "lower": 0.0,
            "upper": 3.0,
            "scale": "linear",
        }

    varied = written(tmp_path, free)
    hashes = {tyre_sha256(with_values(varied, {"filler": value})) for value in (0.0, 1.0, 3.0)}
    assert hashes == {tyre_sha256(varied)}


def test_a_section_from_an_outline(tmp_path: Path) -> None:
    """The contents of its curves and numbers count, not the points drawn from them while a number
    varies."""

    def outlined(data: dict[str, Any]) -> None:
        data["section"] = {
            "outline": {"file": "curves.csv", "belt_width_m": 0.148, "rim_radius_m": 0.2}
        }
        data["variables"]["depth"] = {
            "sets": ["section.outline.belt_depth_m"],
            "start": 1.2e-3,
            "lower": 1e-3,
            "upper": 2e-3,
        }

    curves = (CASES / "205_60r15_outline.csv").read_text()
    (tmp_path / "curves.csv").write_text(curves)
    case = written(tmp_path, outlined, DRAWN)
    plain = tyre_sha256(case)
    deeper = with_values(case, {"depth": 1.5e-3})
    assert (deeper.section.points != case.section.points).any()
    assert tyre_sha256(deeper) == tyre_sha256(with_level(case, "coarse")) == plain
    assert tyre_sha256(with_values(case, {"section.outline.belt_width_m": 0.149})) != plain
    (tmp_path / "renamed.csv").write_text(curves.replace("\n", "\r\n"))

    def renamed(data: dict[str, Any]) -> None:
        outlined(data)
        data["section"]["outline"] |= {"file": "renamed.csv", "belt_step_m": 0.01}

    assert tyre_sha256(written(tmp_path, renamed, DRAWN)) == plain
    (tmp_path / "curves.csv").write_text(_nudged(curves.splitlines()))
    assert tyre_sha256(written(tmp_path, outlined, DRAWN)) != plain


def test_the_text_of_own_templates(tmp_path: Path, case: LoadedCase) -> None:
    """Every file that a template can include counts, and no other in their folder."""
    own = tmp_path / "own"
    (own / "parts").mkdir(parents=True)

    loaded = written(tmp_path, lambda data: data.update(templates="own"))
    assert tyre_sha256(loaded) == tyre_sha256(case)  # it has none yet
    hashes = [tyre_sha256(case)]
    for name in ("inflate.inp.j2", "parts/more.j2"):
        (own / name).write_text("*HEADING\n")
        hashes.append(tyre_sha256(loaded))
        (own / name).write_text("*HEADING, SPARSE\n")
        hashes.append(tyre_sha256(loaded))
    assert len({*hashes}) == len(hashes)
    (own / name).write_bytes(b"*HEADING, SPARSE\r\n")
    (own / "README.md").write_text("ours")
    assert tyre_sha256(loaded) == hashes[-1]


def test_a_fit_with_other_templates_is_refused(tmp_path: Path) -> None:
    template = tmp_path / "own" / "inflate.inp.j2"
    template.parent.mkdir()
    template.write_text("*HEADING\n")
    case = written(tmp_path, lambda data: data.update(templates="own"))
    values = start_values(case)
    of = {"tyre_sha256": tyre_sha256(case), "mesh": "default"}
    content = {"variables": {}, "fixed": values, "pressure_kPa": 240.0, "provenance": of}
    (tmp_path / "fit.json").write_text(json.dumps(content))
    assert read_fitted(tmp_path / "fit.json", case) == (values, [])
    template.write_text("*HEADING\n** lighter\n")
    with pytest.raises(InputError, match="or a file that it names, has been edited since"):
        read_fitted(tmp_path / "fit.json", case)
