"""tyrecal measured: the shipped files become measurements that fit and diagnosis read; what is
wrong with a file is told in one sentence."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff

from tyrecal.errors import InputError
from tyrecal.measured.tables import read_measurements
from tyrecal.measured.targets import readings_with_shapes
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.observations import observe
from tyrecal.tyre.load import load_case

from ..measured.test_universal import ANGLES, function, geometry, shape, units, write
from ..studies.measured_data import (
    BAND,
    CASES,
    TRUTH,
    evaluated,
    write_shapes,
    write_soft_clamp,
    write_table,
)
from .test_cli import run

FOLDER = CASES / "measured"
FUNCTIONS = sorted(FOLDER.glob("*_240kPa_*.uff"))
SHAPES, TABLE = FOLDER / "p235_75r17_200kPa_shapes.uff", FOLDER / "p235_75r17_280kPa_table.csv"
TEST = ["--directions", "cylindrical", "--highest-harmonic", "8"]


def truth(pressure_kPa: float) -> dict[Label, float]:
    modes = evaluated(pressure_kPa)
    return {m.label: m.frequency_Hz for m in modes if BAND[0] < m.frequency_Hz < BAND[1]}


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Measurements of the three repeats of functions at 240 kPa."""
    path = tmp_path_factory.mktemp("measured") / "at_240.csv"
    files = [str(file) for file in FUNCTIONS]
    code = run(
        "measured",
        "import",
        *files,
        "--pressure-kPa",
        "240",
        "--band",
        "28,132",
        *TEST,
        "--output",
        str(path),
        "--quiet",
    )
    assert code == 0 and len(files) == 3
    return path


@pytest.mark.slow
def test_functions_become_the_true_frequencies(identified: Path) -> None:
    readings, right = read_measurements(identified), truth(240.0)
    assert {each.label for each in readings} == set(right)
    for each in readings:
        assert each.label is not None and abs(each.value - right[each.label]) < 2.5 * each.sigma
        assert each.sigma < 0.002 * each.value
    picture = identified.with_suffix(".png")
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_fit_to_them_finds_the_true_design(
    identified: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = run(
        "fit",
        str(CASES / "p235_75r17.yaml"),
        "--measured",
        str(identified),
        "--output",
        str(tmp_path / "fitted"),
        "--no-pictures",
        "--json",
    )
    fit = json.loads(capsys.readouterr().out)
    assert code == 0 and fit["objective_unit"] == "sigma" and fit["objective_Hz"] < 4
    assert {Label(m["c"], m["m"], m["kind"]) for m in fit["modes"]} == set(truth(240.0))
    assert len(fit["shapes"]) == 3  # repeats, compared with the fitted tyre
    for each in fit["shapes"]:
        assert all(p["computed"] == p["measured"] for p in each["pairs"] if p["decided"])
        assert sum(p["decided"] for p in each["pairs"]) >= len(each["pairs"]) - 1
    for name, value in TRUTH.items():
        variable = fit["variables"][name]
        assert abs(variable["value"] - value) < 2.5 * variable["standard_error"]


def test_several_kinds_of_files_join_and_the_diagnosis_reads_them(
    identified: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shapes, table, joined = (tmp_path / name for name in ("s.csv", "t.csv", "j.csv"))
    assert (
        run(
            "measured",
            "import",
            str(SHAPES),
            "--pressure-kPa",
            "200",
            *TEST,
            "--sigma-percent",
            "0.2",
            "--output",
            str(shapes),
            "--no-pictures",
            "--json",
        )
        == 0
    )
    summary = json.loads(capsys.readouterr().out)
    assert all(mode["confidence"] > 0.9 and not mode["why"] for mode in summary["modes"])
    right = truth(200.0)
    for mode in summary["modes"]:
        label = Label(mode["c"], mode["m"], mode["kind"])
        assert mode["frequency_Hz"] == pytest.approx(right[label], rel=0.005)
        assert mode["member"] in (("1", "2") if label.c else ("",))
    assert run("measured", "import", str(TABLE), "--output", str(table)) == 0
    assert (
        run("measured", "import", str(shapes), str(identified), str(table), "--output", str(joined))
        == 0
    )
    readings = read_measurements(joined)
    assert {each.pressure_kPa for each in readings} == {200.0, 240.0, 280.0}
    observed = observe(readings)
    assert len(observed.rows) == 10 + 9 + 9 and not observed.left_out
    splits = observed.split[np.isfinite(observed.split)]
    assert len(splits) == 8 and np.median(splits) == pytest.approx(0.004, abs=0.001)


def test_fits_take_what_is_at_their_pressure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from tyrecal.measured.targets import with_measured
    from tyrecal.tyre.load import load_case
    from tyrecal.tyre.values import overridden

    lines = [
        "frequency_Hz,2,1,,1,240,0,66.0,0.3",
        "frequency_Hz,2,1,,2,240,0,66.4,0.4",
        "frequency_Hz,5,0,,,240.5,0,130,0.5",
        "frequency_Hz,3,0,,,239.4,0,98,0.5",
        "frequency_Hz,2,1,,,200,0,60,0.3",
        "frequency_Hz,2,1,,symmetric,240,4000,70,0.3",
        "mass_kg,,,,,,,12,0.1",
        "vertical_stiffness_N_per_m,,,,,240,4000,2e5,4000",
    ]
    path = tmp_path / "m.csv"
    head = "quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma\n"
    path.write_text(head + "\n".join(lines) + "\n")
    case = load_case(CASES / "p235_75r17.yaml")
    loaded, left_out = with_measured(case, path)
    states = {(t.pressure_kPa, t.load_N) for t in loaded.case.targets.modes}
    assert not left_out and states == {(None, None), (239.4, None), (200, None), (None, 4000)}
    loaded, left_out = with_measured(overridden(case, {"pressure_kPa": 240.0}), path)
    loaded_mode = loaded.case.targets.modes[-1]
    assert (loaded_mode.load_N, loaded_mode.symmetry) == (4000, "symmetric")
    modes = {(t.c, t.m): (t.frequency_Hz, t.sigma_Hz) for t in loaded.case.targets.modes[:-1]}
    assert modes == {(2, 1): pytest.approx((66.2, 0.25)), (5, 0): pytest.approx((130, 0.5))}
    assert loaded.case.targets.mass is not None and loaded.case.targets.mass.sigma_kg == 0.1
    (pressed,) = loaded.case.targets.footprint
    assert (pressed.vertical_stiffness_N_per_m, pressed.sigma_N_per_m) == (2e5, 4000)
    assert loaded.case.analysis.highest_harmonic == 5
    assert left_out == ["2 values at 200 kPa, 239.4 kPa"]
    code = run(
        "fit",
        str(CASES / "p235_75r17.yaml"),
        "--measured",
        str(path),
        "--pressure-kPa",
        "150",
        "--output",
        str(tmp_path / "f"),
    )
    assert code == 2
    message = capsys.readouterr().err
    assert "no target was measured at 150 kPa, only at 200 kPa, 239.4 kPa, 240 kPa: set" in message


def test_sensors_are_judged_before_a_test(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("measured", "sensors", str(SHAPES), *TEST, "--json") == 0
    entries = json.loads(capsys.readouterr().out)
    assert len(entries) == 5 + 4 * 8
    assert all(entry["told"] for entry in entries if entry["m"] == 0)
    looks_like = {(entry["c"], entry["m"]): entry["looks_like"] for entry in entries}
    assert looks_like[1, 2][0] == "[1,0]"  # no two of the tread's sensors share an angle
    even = {
        **geometry(),
        "x": 0.39 * np.cos(np.arange(8) * np.pi / 4),
        "y": 0.39 * np.sin(np.arange(8) * np.pi / 4),
    }
    path = write(tmp_path / "even.uff", even, shape(np.ones((8, 3), complex)))
    assert run("measured", "sensors", str(path), *TEST) == 0
    assert "cannot tell [3,0], it looks like" in capsys.readouterr().out
    assert run("measured", "sensors", str(path), *TEST, "--json") == 0
    alike = {(e["c"], e["m"]): e["looks_like"] for e in json.loads(capsys.readouterr().out)}
    assert "[5,0]" in alike[3, 0] and "[3,0]" in alike[5, 0]


def test_shapes_are_labelled_by_a_case(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The shapes at 200 kPa by the case at other values: each label is that of the true mode, and
    labelled.csv holds the measured frequencies."""
    code = run(
        "measured",
        "label",
        str(CASES / "p235_75r17.yaml"),
        str(SHAPES),
        *TEST,
        "--set",
        "pressure_kPa=200",
        "--mesh",
        "coarse",
        "--sigma-percent",
        "0.2",
        "--output",
        str(tmp_path / "labelled"),
        "--json",
    )
    result = json.loads(capsys.readouterr().out)
    assert code == 0 and result["provenance"]["measured_sha256"]
    right = truth(200.0)
    for each in result["labels"]["frequencies"]:
        label = Label(each["c"], each["m"], each["kind"])
        assert each["frequency_Hz"] == pytest.approx(right[label], rel=0.005)
        assert each["expected_Hz"] == pytest.approx(right[label], rel=0.03)
        assert each["probability"] > 0.99
    rows = read_measurements(tmp_path / "labelled" / "labelled.csv")
    assert {row.label for row in rows} == set(right)


@pytest.mark.slow
def test_shapes_that_were_imported_without_labels(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`measured label` finds the labels by the shapes next to the table, and pairs them."""
    table = str(tmp_path / "at_200.csv")
    given = [*TEST, "--pressure-kPa", "200", "--sigma-percent", "0.2", "--no-pictures"]
    assert run("measured", "import", str(SHAPES), *given, "--no-labels", "--output", table) == 0
    assert all(row.is_unlabelled for row in read_measurements(Path(table), labelled=False))
    case = [str(CASES / "p235_75r17.yaml"), table, "--mesh", "coarse"]
    assert run("measured", "label", *case, "--output", str(tmp_path / "labelled")) == 0
    right = truth(200.0)
    rows = read_measurements(tmp_path / "labelled" / "labelled.csv")
    pairs = {(row.label, row.member) for row in rows if row.label and row.label.c}
    assert pairs == {(label, member) for label in right for member in "12" if label.c}
    assert {row.label for row in rows} == set(right)
    result = json.loads((tmp_path / "labelled" / "labels.json").read_text())
    (shapes,) = result["shapes"]
    assert [pair["computed"] for pair in shapes["pairs"] if pair["decided"]] == [
        pair["measured"] for pair in shapes["pairs"] if pair["decided"]
    ]


def test_a_universal_file_that_needs_options_is_to_be_imported(tmp_path: Path) -> None:
    path = write(tmp_path / "one.uff", shape(mode_in_plane()))
    with pytest.raises(InputError, match=r"no coordinates.*measured import --no-labels"):
        readings_with_shapes(load_case(CASES / "p235_75r17.yaml"), path)


@pytest.mark.slow
def test_a_diagnosis_takes_functions_as_they_come(tmp_path: Path) -> None:
    """Its labels are those of the true modes, and their probabilities contain the shapes."""
    given = [str(CASES / "p235_75r17.yaml"), "--measured", str(FUNCTIONS[0]), "--mesh", "coarse"]
    more = ["--effect", "spindle_lateral", "--no-pictures", "--output", str(tmp_path)]
    assert run("diagnose", *given, *more) == 0
    labels = json.loads((tmp_path / "diagnosis.json").read_text())["labels"]
    right = truth(240.0)
    by_label = {
        Label(e["c"], e["m"], e["kind"]): e for e in labels["frequencies"] if e["c"] is not None
    }
    for label, hertz in right.items():
        assert by_label[label]["frequency_Hz"] == pytest.approx(hertz, rel=0.005)
        assert by_label[label]["probability"] > 0.99


def test_options_of_universal_files_are_refused_with_a_table(
    capsys: pytest.CaptureFixture[str],
) -> None:
    case = str(CASES / "p235_75r17.yaml")
    assert run("measured", "label", case, str(TABLE), "--directions", "cylindrical") == 2
    assert "280kPa_table.csv is a table, not a universal file" in capsys.readouterr().err


def mode_in_plane(c: int = 2) -> np.ndarray:
    """(8, 3), cylindrical, at the angles of test_universal."""
    turn = c * ANGLES
    return np.column_stack([np.cos(turn), -np.sin(turn) / c, 0 * turn]) + 0j


def one_sensor() -> list[dict[str, Any]]:
    lone = shape(mode_in_plane())
    return [
        geometry(),
        {
            **lone,
            "node_nums": lone["node_nums"][:1],
            **{r: lone[r][:1] for r in ("r1", "r2", "r3")},
        },
    ]


def test_a_frequency_without_a_label_is_written_without_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As a list that `fit` and `measured label` read."""
    path, output = write(tmp_path / "one.uff", *one_sensor()), tmp_path / "m.csv"
    given = ["--pressure-kPa", "240", "--sigma-percent", "0.3", "--directions", "cylindrical"]
    assert run("measured", "import", str(path), *given, "--output", str(output)) == 0
    words = "1 of 1 values are frequencies without a label (aliasing: sensors at 1 angle, "
    assert words in " ".join(capsys.readouterr().err.split())
    (row,) = read_measurements(output, labelled=False)
    assert row.is_unlabelled and row.value == pytest.approx(66.1, rel=1e-4)
    assert row.sigma == pytest.approx(0.003 * 66.1, rel=1e-2) and row.pressure_kPa == 240


F = np.arange(20.0, 80.0, 0.5)
BAD: list[tuple[list[dict[str, Any]], list[str], str]] = [
    ([geometry(scale=1e3), shape(mode_in_plane())], [], "largest radius about z is 390 m, no tyre"),
    ([units(1e3), geometry(), shape(mode_in_plane())], [], "largest radius about z is 0.00039 m"),
    ([shape(mode_in_plane())], [], "node 1 has no coordinates; give the file with data set 15 or"),
    (
        [geometry(), {**shape(mode_in_plane()), "analysis_type": 2, "freq": -66.0}],
        [],
        "data set 2 (type 55, line",
    ),
    ([geometry()], [], "there is neither a mode shape nor a frequency-response function"),
    (
        [function(np.ones(120) + 0j, F, k, func_type=t) for k, t in ((1, 1), (2, 1), (3, 9))],
        [],
        "function, only 2 x time response, 1 x power spectral density",
    ),
    ([geometry(), shape(mode_in_plane())], ["--centre", "1,0"], "--centre 1,0: must be 3 numbers"),
    ([geometry(), shape(mode_in_plane())], ["--band", "60,30"], "must rise from 0 or more"),
    (
        [geometry(), function(np.ones(120) + 0j, F), function(np.ones(120) + 0j, F)],
        [],
        "data set 3 (type 58, line",
    ),
    (
        [geometry(), function(np.ones(120) + 0j, F, ordinate_spec_data_type=0)],
        [],
        "does not state whether displacement, velocity or acceleration was measured",
    ),
    (
        [geometry(), function(np.ones(120) + 0j, F), function(np.ones(120) + 0j, F + 1, 2)],
        [],
        "its frequencies are not those of the first",
    ),
    (
        [geometry(), function(np.ones(120) + 0j, F), function(np.ones(120) + 0j, F, 2)],
        ["--band", "30,70"],
        "no mode is stable between 30 and 70 Hz",
    ),
]


@pytest.mark.parametrize(("sets", "given", "words"), BAD, ids=[words[:30] for *_, words in BAD])
def test_bad_files_get_one_sentence_and_exit_code_2(
    sets: list[dict[str, Any]],
    given: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, output = write(tmp_path / "bad.uff", *sets), tmp_path / "m.csv"
    code = run(
        "measured",
        "import",
        str(path),
        "--pressure-kPa",
        "240",
        "--sigma-percent",
        "0.3",
        "--directions",
        "cylindrical",
        *given,
        "--output",
        str(output),
    )
    printed = capsys.readouterr().err.strip()
    assert code == 2 and not output.exists()
    last = printed.splitlines()[-1]
    assert words in last and "Traceback" not in printed
    assert given or (last.startswith(f"error: {path}") and len(printed.splitlines()) == 1)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([str(SHAPES)], "universal files hold no pressure; give --pressure-kPa"),
        ([str(SHAPES), "--pressure-kPa", "240", *TEST], "may be off: give repeats, a column sigma"),
        ([str(TABLE), "--output", str(TABLE)], "is one of the files to read"),
        (["missing.uff"], "missing.uff: there is no such file"),
        ([str(CASES / "pictures/modes.png")], "neither text nor a universal file"),
    ],
)
def test_what_is_lacking_is_asked_for(
    given: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = [] if "--output" in given else ["--output", str(tmp_path / "m.csv")]
    assert run("measured", "import", *given, *out) == 2
    printed = capsys.readouterr().err
    assert words in printed and "Traceback" not in printed


@pytest.mark.slow
def test_help_and_tables_import_nothing_heavy() -> None:
    for command, kept_out in (
        (["measured", "import", "--help"], ("numpy", "pyuff", "matplotlib")),
        (["measured", "import", str(TABLE), "--output", "-no-such/m.csv"], ("pyuff", "matplotlib")),
    ):
        code = (
            "import sys; sys.argv[0] = 'tyrecal'\nfrom tyrecal.cli.main import main\n"
            f"try: main({command!r})\nexcept SystemExit: pass\n"
            f"print([m for m in {kept_out!r} if m in sys.modules])"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.stdout.splitlines()[-1] == "[]", done.stdout + done.stderr


@pytest.mark.slow
def test_the_shipped_files_are_the_scripts(tmp_path: Path) -> None:
    write_shapes(tmp_path, np.random.default_rng((20, 1)))
    write_table(tmp_path, np.random.default_rng((20, 2)))
    write_soft_clamp(tmp_path, np.random.default_rng((20, 3)))
    for name in (TABLE.name, "p235_75r17_soft_clamp.csv"):
        assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes()
    ours, shipped = (
        pyuff.UFF(str(folder / SHAPES.name)).read_sets() for folder in (tmp_path, FOLDER)
    )
    assert len(ours) == len(shipped)
    for one, other in zip(ours[3:], shipped[3:], strict=True):
        assert one["eig"] == pytest.approx(other["eig"], rel=1e-4)
        assert abs(np.vdot(one["r1"], other["r1"])) == pytest.approx(
            np.linalg.norm(one["r1"]) * np.linalg.norm(other["r1"]), rel=1e-3
        )
    assert sum(file.stat().st_size for file in FOLDER.iterdir()) < 500_000
