"""The pressure sweep drawn and tabulated."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from tyrecal.report import pressure
from tyrecal.report.figure import save
from tyrecal.report.pressure import draw_pressure_sweep
from tyrecal.report.table import shown
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.pressure import PressureFindings
from tyrecal.studies.pressure_result import PressureRow, PressureSweep

LABELS = [(0, 0, "axial"), (0, 0, "torsional"), (1, 0, None), (1, 1, None), (2, 0, None)]


def rows(labels=LABELS, designs=("initial", "fitted"), pressures=(100.0, 200.0, 320.0), slope=0.4):
    entries = [
        {
            "design": design,
            "pressure_kPa": p,
            "modes": [
                {
                    "c": c,
                    "m": m,
                    "kind": kind,
                    "multiplicity": 2 if c else 1,
                    "frequency_Hz": (30 + 20 * c - 9 * m + k) * (p / 200) ** 0.4,
                    "d_ln_f_d_ln_p": slope,
                }
                for c, m, kind in labels
            ],
        }
        for k, design in enumerate(designs)
        for p in pressures
    ]
    return [PressureRow.model_validate(row) for row in entries]


@pytest.mark.slow
def test_each_mode_is_drawn_in_its_family_and_named_once(tmp_path):
    path = tmp_path / "sweep.png"
    figure = draw_pressure_sweep(rows(), [(Label(2, 0), 240.0, 79.5)])
    save(figure, path)
    with Image.open(path) as image:
        assert image.format == "PNG" and image.size == (1440, 1140)
        assert 0.02 < (np.asarray(image.convert("L")) < 245).mean() < 0.2
    assert path.stat().st_size < 150_000
    inner, outer = figure.axes[:2]
    assert (inner.get_title("left"), outer.get_title("left")) == ("in-plane", "out-of-plane")
    assert {t.get_text() for t in inner.texts} == {"[0,0] torsional", "[1,0]", "[2,0]"}
    assert {t.get_text() for t in outer.texts} == {"[0,0] lateral", "[1,1]"}
    assert sum(len(line.get_xdata()) == 3 for line in inner.lines) == 6
    dashed = [x for x in inner.lines if len(x.get_xdata()) == 3 and x.get_linestyle() == "--"]
    assert len(dashed) == 3
    (cross,) = (x for x in inner.lines if list(x.get_xdata()) == [240.0])
    assert list(cross.get_ydata()) == [79.5]


@pytest.mark.slow
def test_targets_of_another_pressure_do_not_stretch_the_axis(tmp_path):
    figure = draw_pressure_sweep(rows(), [(Label(2, 0), 500.0, 79.5)])
    save(figure, tmp_path / "sweep.png")
    assert figure.axes[0].get_xlim()[1] < 340
    assert "target" not in [t.get_text() for t in figure.axes[0].get_legend().get_texts()]


@pytest.mark.parametrize(
    "given",
    [
        rows(designs=("initial",), pressures=(200.0,), slope=None),
        rows(labels=[(0, 1, None), (3, 2, None), (14, 0, None)]),
        rows()[:-2],
    ],
    ids=["one pressure", "overtones", "failed pressures"],
)
def test_whatever_was_found_is_drawn(given, tmp_path):
    save(draw_pressure_sweep(given), tmp_path / "sweep.png")
    assert (tmp_path / "sweep.png").exists()


def test_names_that_would_touch_are_moved_apart():
    place = pressure.apart([0.30, 0.31, 0.32, 0.8], 0.05)
    assert min(np.diff(place)) > 0.05 - 1e-3
    assert place[1] == pytest.approx(0.31, abs=1e-3) and place[3] == 0.8


def test_table_and_csv():
    given = rows(designs=("initial",))
    fields = {
        "design": "initial",
        "from_kPa": 100.0,
        "to_kPa": 320.0,
        "modes": [
            {
                "c": c,
                "m": m,
                "kind": kind,
                "rise_Hz": 12.345,
                "rise_percent": 59.2,
                "curvature": "concave",
            }
            for c, m, kind in LABELS
        ],
    }
    console = Console(width=110, record=True)
    sweep = PressureSweep(rows=given, findings=[PressureFindings(**fields, words=[])])
    console.print(shown(*sweep.tables()))
    text = console.export_text()
    line = next(line for line in text.splitlines() if line.startswith("[2,0]"))
    assert "ovalisation" in line and "+12.3" in line and "+59.2" in line and "0.400" in line
    csv = sweep.csv().splitlines()
    assert len(csv) == 1 + 3 * 5
    assert csv[1].startswith("initial,100.0,0,0,axial,1,22.7")
    assert PressureSweep(rows=rows(slope=None), findings=[]).csv().splitlines()[-1].endswith(",")
