"""The .tir of a tyre: known keys come back, and an independent reader meets each stated misfit."""

from __future__ import annotations

import json
import re
from math import atan, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.mf_swift import MFSwift
from tyrecal.measured.tir import property_measurements, read_property_file
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import Evaluation, HarmonicShape, RawMode
from tyrecal.simulate.provenance import provenance
from tyrecal.studies.property_file import StructuralKeys, property_text, structural_keys
from tyrecal.studies.stiffness import StiffnessResult, StiffnessRow
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case

from ..chance import generator
from ..cli.test_cli import run
from ..conftest import CASES
from ..measured.test_tir import PUBLIC, written

CASE = load_case(CASES / "205_60r15.yaml")
FREQUENCIES = {"FREQ_LONG": 77.17, "FREQ_LAT": 42.41, "FREQ_YAW": 53.49, "FREQ_WINDUP": 58.95}
MASS, DIAMETRAL, POLAR = 7.247, 0.3519, 0.5698


class Ring:
    """A solver whose tyre is a rigid belt on a soft sidewall."""

    name = "bundled"

    def __init__(self) -> None:
        self.solver, self.questions = self, [Question({})]

    def evaluate(self, question: Question) -> Evaluation:
        self.questions.append(question)
        z = np.linspace(-0.08, 0.08, 9)
        points = np.array([*((0.3, each) for each in z), (0.25, -0.1), (0.25, 0.1)])
        part = np.array([1.0] * 9 + [0.5] * 2)
        r, theta, axle = part[:, None] * np.eye(3)[:, None]
        modes = [
            ("FREQ_LAT", 0, 1j * axle / sqrt(MASS)),
            ("FREQ_WINDUP", 0, 0.3 * theta / sqrt(POLAR)),
            ("FREQ_LONG", 1, (r + 1j * theta) / sqrt(MASS)),
            ("FREQ_YAW", 1, 0.3 * axle / sqrt(DIAMETRAL)),
        ]
        raw = [
            RawMode(
                FREQUENCIES[key],
                HarmonicShape(n, np.arange(11), points, amplitude + 0j),
                1 + (n > 0),
                damping_ratio=0.04 + 0.01 * n,
            )
            for key, n, amplitude in modes
        ]
        return Evaluation(220.0, 9.3, tuple(raw))


def rows_of(tyre: MFSwift, loads: list[float], pressures: list[float], noise: float = 0.0) -> Any:
    """Rows on the formulas of a set, without those of the rim; ``noise``: relative."""
    off = generator(7).normal(size=(len(loads), len(pressures), 7))
    rows = []
    for i, load in enumerate(loads):
        for j, kPa in enumerate(pressures):
            dp = kPa / 220 - 1
            deflection = tyre.deflection(load, dp)
            rough = 1 + noise * off[i, j]
            exact = (
                deflection,
                tyre.patch_length(load, dp),
                tyre.patch_width(load, dp),
                tyre.rolling_radius(load, dp),
                tyre.longitudinal(load, dp),
                tyre.lateral(load, dp),
                tyre.yaw(load, dp),
            )
            deflection, length, width, rolling, along, across, yaw = np.array(exact) * rough
            rows.append(
                StiffnessRow(
                    design="fitted",
                    pressure_kPa=kPa,
                    load_N=load,
                    vertical_N_per_m=1.05 * tyre.vertical(load, dp),
                    vertical_sliding_N_per_m=tyre.vertical(load, dp),
                    lateral_N_per_m=across,
                    longitudinal_N_per_m=along,
                    torsional_Nm_per_rad=yaw,
                    loaded_radius_m=tyre.free_radius - deflection,
                    rolling_radius_m=rolling,
                    deflection_m=deflection,
                    length_m=length,
                    width_m=width,
                    rim_stiffness=[[0.0] * 6] * 6,
                )
            )
    return rows


def result_of(rows: list[StiffnessRow]) -> StiffnessResult:
    designs = {"initial": {}, "fitted": start_values(CASE)}
    return StiffnessResult(designs=designs, rows=rows, failed=[], findings=[])


def public(folder: Path) -> MFSwift:
    """The public set with the radius at rest as its only one."""
    keys = dict(read_property_file(written(folder, PUBLIC, "public.tir")).model.keys)
    keys["UNLOADED_RADIUS"] *= keys["Q_RE0"]
    return MFSwift({**keys, "Q_RE0": 1.0})


def keys_of(rows: list[StiffnessRow], **nominal: float) -> StructuralKeys:
    ring: Any = Ring()
    return structural_keys(CASE, result_of(rows), ring, **nominal)


LOADS, PRESSURES = [2000.0, 3000.0, 4000.0, 5000.0, 6000.0], [200.0, 220.0, 240.0]


def test_known_keys_come_back(tmp_path: Path) -> None:
    """From rows on the formulas: to the digits that the file has."""
    tyre = public(tmp_path)
    ours = keys_of(rows_of(tyre, LOADS, PRESSURES)).tyre
    known = {key: x for key, x in tyre.keys.items() if key in ours.keys and key != "INFLPRES"}
    assert len(known) == 33
    damping = {key: 0.05 if key in ("DAMP_LONG", "DAMP_YAW") else 0.04 for key in known}
    known |= {key: damping[key] for key in known if key.startswith("DAMP")}
    assert {key: ours.keys[key] for key in known} == pytest.approx(known, rel=2e-5)
    zero = [ours.keys[key] for key in ("PCFX2", "PCFX3", "PCFY2", "PCMZ1")]
    assert zero == pytest.approx([0] * 4, abs=1e-5)
    assert ours.residual_springs()["yaw"] == pytest.approx(5450, rel=1e-3)


KEY = re.compile(r"^(\w+) *= *([-\w.+]+) *\$ (.*)$", re.MULTILINE)


def curves(k: dict[str, float], load: float, dp: float, deflection: float) -> dict[str, float]:
    """Curves by the words of the file, as written in the model's manual."""
    R0, F0, C = k["UNLOADED_RADIUS"], k["FNOMIN"], k["VERTICAL_STIFFNESS"]
    linear = sqrt((C * R0 / F0) ** 2 - 4 * k["Q_FZ2"])
    rho, f, df = deflection / R0, load / F0, load / F0 - 1
    stiff = C * (1 + k["PFZ1"] * dp)
    x = load / (stiff * R0)
    return {
        "load over deflection": F0 * (1 + k["PFZ1"] * dp) * (linear * rho + k["Q_FZ2"] * rho**2),
        "length of the patch": 2 * R0 * (k["Q_RA1"] * sqrt(x) + k["Q_RA2"] * x),
        "width of the patch": 2 * k["WIDTH"] * (k["Q_RB1"] * x ** (1 / 3) + k["Q_RB2"] * x),
        "rolling radius": R0 - F0 / stiff * (k["FREFF"] * f + k["DREFF"] * atan(k["BREFF"] * f)),
        "longitudinal stiffness": k["LONGITUDINAL_STIFFNESS"]
        * (1 + k["PCFX1"] * df + k["PCFX2"] * df**2)
        * (1 + k["PCFX3"] * dp),
        "lateral stiffness": k["LATERAL_STIFFNESS"]
        * (1 + k["PCFY1"] * df + k["PCFY2"] * df**2)
        * (1 + k["PCFY3"] * dp),
        "torsional stiffness": k["YAW_STIFFNESS"] * (1 + k["PCMZ1"] * dp),
    }


COLUMNS = {
    "load over deflection": "load_N",
    "length of the patch": "length_m",
    "width of the patch": "width_m",
    "rolling radius": "rolling_radius_m",
    "longitudinal stiffness": "longitudinal_N_per_m",
    "lateral stiffness": "lateral_N_per_m",
    "torsional stiffness": "torsional_Nm_per_rad",
}


def test_an_independent_reader_meets_the_stated_misfits(tmp_path: Path) -> None:
    """The largest deviation of rows that are off the formulas by 1 % is the stated one."""
    rows = rows_of(public(tmp_path), LOADS, PRESSURES, noise=0.01)
    text = property_text(CASE, keys_of(rows))
    entries = {key: (float(x), words) for key, x, words in KEY.findall(text)}
    keys = {key: value for key, (value, _) in entries.items()}
    known = [words for _, words in entries.values() if " within " in words]
    assert {words.split(" within ")[0] for words in known} == set(COLUMNS)
    for words in set(known):
        name, _, stated = words.partition(" within ")
        off = {row.load_N: [] for row in rows}
        for row in rows:
            there = curves(keys, row.load_N, row.pressure_kPa / 220 - 1, row.deflection_m)[name]
            off[row.load_N].append(abs(there / getattr(row, COLUMNS[name]) - 1))
        largest = lambda loads, off=off: pytest.approx(
            100 * max(max(off[load]) for load in loads), abs=0.011
        )
        assert float(stated.split(" %")[-2].split()[-1]) == largest(LOADS)
        near = re.search(r"([\d.]+) % from 3000 to 5000 N", stated)
        assert bool(near) == (name == "torsional stiffness")
        assert not near or float(near[1]) == largest(LOADS[1:4])
    assert "\nFITTYP = 62\n" in text
    belt = (2 * pi * keys["FREQ_LONG"]) ** 2 * keys["BELT_MASS"]
    assert belt == pytest.approx(1.7038e6, rel=1e-4)


def test_our_file_is_read_back_as_measurements(tmp_path: Path) -> None:
    keys = keys_of(rows_of(public(tmp_path), LOADS, PRESSURES))
    path = written(tmp_path, property_text(CASE, keys))
    back, ranges = read_property_file(path).model.keys, {"PRESMIN", "PRESMAX", "FZMIN", "FZMAX"}
    assert back == {"FITTYP": 62} | {k: x for k, x in keys.tyre.keys.items() if k not in ranges}
    rows, _ = property_measurements(path)
    assert {row.value for row in rows if row.label} == set(FREQUENCIES.values())


def test_one_pressure_and_another_solver(tmp_path: Path) -> None:
    """Influences of the pressure, and the belt's inertia, are left out and reported."""
    ring: Any = Ring()
    ring.name = "another"
    rows = rows_of(public(tmp_path), LOADS, [220.0])
    keys = structural_keys(CASE, result_of(rows), ring, nominal_N=3000.0)
    assert keys.tyre.keys["FNOMIN"] == 3000
    assert not {"PFZ1", "PCFX3", "PCFY3", "PCMZ1", "BELT_MASS"} & keys.tyre.keys.keys()
    assert sum("stiffness.json has only one" in note for note in keys.notes) == 1
    assert sum("shapes have no known modal mass" in note for note in keys.notes) == 1


def test_a_key_that_the_loads_do_not_determine_is_reported(tmp_path: Path) -> None:
    """The arc tangent of BREFF is flat at all loads."""
    tyre = MFSwift({**public(tmp_path).keys, "BREFF": 500.0})
    entries = keys_of(rows_of(tyre, LOADS, [220.0])).sections["VERTICAL"]
    assert "BREFF at the end of its range, not determined" in entries["BREFF"][1]
    assert "not determined" not in entries["VERTICAL_STIFFNESS"][1]


def test_slip_comes_from_a_named_donor(tmp_path: Path) -> None:
    donor = PUBLIC + "[LATERAL_COEFFICIENTS]\nPCY1 = 1.3\n[VENDOR]\nA = 1\n"
    file = read_property_file(written(tmp_path, donor, "slip.tir"))
    keys = keys_of(rows_of(public(tmp_path), LOADS, PRESSURES))
    text = property_text(CASE, keys, file)
    assert text.endswith("[LATERAL_COEFFICIENTS]\n$ from slip.tir, FITTYP 61\nPCY1 = 1.3\n")
    assert "slip" not in text.split("[LATERAL")[0]
    assert "left out: coefficients of slip" in property_text(CASE, keys)
    other = keys_of(rows_of(public(tmp_path), LOADS, PRESSURES), nominal_N=5000.0)
    with pytest.raises(InputError, match=r"FNOMIN is 4000, here 5000: .*--nominal-load-N"):
        property_text(CASE, other, file)
    file = read_property_file(written(tmp_path, donor.replace("'meter'", "'mm'"), "slip.tir"))
    with pytest.raises(InputError, match=r"\[UNITS\] must be meter"):
        property_text(CASE, keys, file)
    with pytest.raises(InputError, match="no coefficients of slip in it"):
        property_text(CASE, keys, read_property_file(tmp_path / "public.tir"))


def test_refused(tmp_path: Path) -> None:
    """Too few loads; a nominal state without a row; a belt softer than the tyre."""
    tyre = public(tmp_path)
    with pytest.raises(InputError, match="has 2 loads, a curve needs 3: run 'tyrecal"):
        keys_of(rows_of(tyre, LOADS[:2], PRESSURES))
    with pytest.raises(InputError, match="no row at 3500 N and 220 kPa: give those of a row"):
        keys_of(rows_of(tyre, LOADS, PRESSURES), nominal_N=3500.0)
    stiff = MFSwift({**tyre.keys, "LATERAL_STIFFNESS": 4e5})
    with pytest.raises(InputError, match="between belt and patch along y would be negative"):
        keys_of(rows_of(stiff, LOADS, PRESSURES))


def test_the_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From stiffness.json of the same tyre; options of another format are refused."""
    monkeypatch.setattr(Evaluator, "evaluate", lambda self, question: Ring().evaluate(question))
    evaluator: Any = Ring()
    evaluator.version = "1"
    result = result_of(rows_of(public(tmp_path), LOADS, PRESSURES))
    content = result.stamped(provenance(CASE, evaluator)).content()
    (tmp_path / "stiffness.json").write_text(json.dumps(content))
    arguments = ["export", str(tmp_path), "--case", str(CASES / "205_60r15.yaml")]
    assert run(*arguments, "--format", "tir") == 0
    assert "BELT_MASS" in (tmp_path / "export" / "205_60r15.tir").read_text()
    assert run(*arguments, "--donor", str(tmp_path / "public.tir")) == 2
    assert "--donor goes with --format tir" in capsys.readouterr().err
    assert run(*arguments) == 2
    assert "there is no fit.json" in capsys.readouterr().err
    content["provenance"]["tyre_sha256"] = "0"
    (tmp_path / "stiffness.json").write_text(json.dumps(content))
    assert run(*arguments, "--format", "tir", "--force") == 2
    assert "is of another tyre than" in capsys.readouterr().err
