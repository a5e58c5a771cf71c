"""Results say what they are of, and a fit is taken for the tyre that it is of."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from tyrecal.simulate.provenance import measured_sha256
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from ..studies.hertz import coarser_case
from .test_cli import run

KEYS = {
    "tyrecal",
    "solver",
    "solver_version",
    "name",
    "size",
    "tyre_sha256",
    "overrides",
    "state",
    "mesh",
    "targets",
    "measured_sha256",
}
MEASURED = """quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma
frequency_Hz,2,0,,,240,0,79.5,0.4
frequency_Hz,2,1,,,240,0,66.1,0.4
frequency_Hz,3,0,,,240,0,97.6,0.4
"""
TURNED = "rebar_layers.belt_1.angle_deg"


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A case, measurements, and in ``out`` the results of several studies of it."""
    folder = tmp_path_factory.mktemp("project")
    case = coarser_case(folder)
    (folder / "measured.csv").write_text(MEASURED)
    quiet = ["--output", str(folder / "out"), "--no-pictures", "--quiet"]
    fit = ["fit", str(case), "--measured", str(folder / "measured.csv"), "--report"]
    assert run(*fit, *quiet) in (0, 4)
    assert run("modes", str(case), "--set", f"{TURNED}=68", *quiet) == 0
    fitted = ["--fitted", str(folder / "out/fit.json")]
    assert run("sweep-pressure", str(case), "--steps", "2", *fitted, *quiet) == 0
    effect = ["effects", "tread_density", "--case", str(case), "--pressures-kPa", "240"]
    assert run(*effect, *quiet) == 0
    return folder


def read(path: Path) -> Any:
    return json.loads(path.read_text())


def test_every_result_file_carries_it(project: Path) -> None:
    case = load_case(next(project.glob("*.yaml")))
    files = {path.name: read(path) for path in (project / "out").glob("*.json")}
    runs = files.pop("run.json")
    assert set(runs) == {"fit", "modes", "sweep-pressure", "effects"}
    assert all(facts["finished"] for facts in runs.values())
    reference = (CASES / "site/result_keys.md").read_text(encoding="utf-8")
    assert not [key for facts in runs.values() for key in facts if f"`{key}`" not in reference]
    assert {*files} == {
        "fit.json",
        "fit_shapes.json",
        "modes.json",
        "modes_shapes.json",
        "pressure_sweep.json",
        "effects.json",
    }
    for name, content in files.items():
        for each in content if isinstance(content, list) else [content]:
            of = each["provenance"]
            is_measured = {"measured_files"} if of["measured_sha256"] else set()
            assert set(of) == KEYS | is_measured, name
            same = of["tyre_sha256"] == tyre_sha256(case)
            assert same == (not name.startswith("modes")) == (of["overrides"] == {})
            assert (of["mesh"], of["solver"]) == (case.case.mesh.level, "bundled")
    of = files["fit.json"]["provenance"]
    assert of["measured_sha256"] == sha256(MEASURED.encode()).hexdigest()
    assert [Path(name).suffix for name in of["measured_files"]] == [".csv"]
    assert of["state"] == {"pressure_kPa": 240.0, "load_N": 0.0, "rim": "fixed"}
    assert files["modes.json"]["provenance"]["overrides"] == {TURNED: 68.0}
    assert files["pressure_sweep.json"]["provenance"]["state"]["pressure_kPa"] == [100.0, 320.0]


@pytest.mark.slow
def test_the_report_tells_the_modified_tyre_from_the_fit(project: Path) -> None:
    assert run("report", str(project / "out"), "--quiet", "--author", "A. Engineer") == 0
    page = (project / "out/report.html").read_text()
    assert ", A. Engineer</p>" in page and f"--set {TURNED}=68" in page
    assert f"{TURNED} = 68" in page and "belong to different tyres" in page


def test_several_measured_files_have_one_hash(tmp_path: Path) -> None:
    files = [tmp_path / name for name in "ab"]
    for path in files:
        path.write_text(path.name)
    assert measured_sha256(files[:1]) == sha256(b"a").hexdigest()
    lines = "".join(f"{sha256(name.encode()).hexdigest()}\n" for name in "ab")
    assert measured_sha256(files) == sha256(lines.encode()).hexdigest()
    assert measured_sha256(files[::-1]) != measured_sha256(files)


@pytest.mark.parametrize(
    ("old", "new", "more", "words"),
    [
        (
            "angle_deg: 70.0",
            "angle_deg: 70.07",
            [],
            "or a file that it names, has been edited since",
        ),
        ("D1_per_Pa: 5.085e-8", "D1_per_Pa: 5.09e-8", [], "has been edited since"),
        (
            "name",
            "name",
            ["--set", f"{TURNED}=70.07"],
            f"without --set {TURNED}, this command runs with --set {TURNED}=70.07",
        ),
        ("frequency_Hz: 31.7", "frequency_Hz: 35.7", [], ""),
        ("upper: 1.0e-5", "upper: 2.0e-5", [], ""),
        ("percent: 3.0", "percent: 4.0", [], ""),
        ("time_limit_s: 300", "time_limit_s: 200", [], ""),
        ("pressure_kPa: 240.0", "pressure_kPa: 230", [], ""),
    ],
)
def test_a_fit_is_of_its_tyre(
    old: str,
    new: str,
    more: list[str],
    words: str,
    project: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    case = coarser_case(tmp_path)
    text = case.read_text()
    assert old in text
    case.write_text(text.replace(old, new, 1))
    sweep = [
        "sweep-pressure",
        str(case),
        "--from-kPa",
        "238",
        "--to-kPa",
        "240",
        "--steps",
        "2",
        "--no-pictures",
        "--output",
        str(tmp_path / "out"),
        "--store",
        str(project / "record"),
        "--fitted",
        str(project / "out/fit.json"),
    ]
    assert run(*sweep, *more) == (2 if words else 0)
    message = capsys.readouterr().err
    assert ("is a fit of another tyre" in message) == bool(words) and words in message


def test_another_mesh_is_taken_and_said(
    project: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = coarser_case(tmp_path)
    fit = read(project / "out/fit.json")
    fit["provenance"]["mesh"] = "another"
    (tmp_path / "fit.json").write_text(json.dumps(fit))
    sweep = [
        "sweep-pressure",
        str(case),
        "--from-kPa",
        "238",
        "--to-kPa",
        "240",
        "--steps",
        "2",
        "--no-pictures",
        "--output",
        str(tmp_path / "out"),
        "--store",
        str(project / "record"),
        "--fitted",
        str(tmp_path / "fit.json"),
    ]
    assert run(*sweep) == 0
    level = load_case(case).case.mesh.level
    words = f"the fit was made on the mesh 'another', this study uses '{level}'"
    assert words in capsys.readouterr().err


def test_a_fit_with_other_numbers_set_says_which(
    project: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = coarser_case(tmp_path)
    fit = read(project / "out/fit.json")
    turned = read(project / "out/modes.json")["provenance"]
    (tmp_path / "fit.json").write_text(json.dumps(fit | {"provenance": turned}))
    again = [
        "footprint",
        str(case),
        "--loads-N",
        "500",
        "--output",
        str(tmp_path / "out"),
        "--set",
        "road.friction=0.4",
        "--fitted",
        str(tmp_path / "fit.json"),
    ]
    assert run(*again) == 2
    *_, error = capsys.readouterr().err.splitlines()
    words = f"made with --set {TURNED}=68, this command runs without --set {TURNED}"
    assert words in error and "friction" not in error
