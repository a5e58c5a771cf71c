"""Numbers, signs and units that pictures and tables show; other wording is not pinned."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tyrecal.cli.doctor import _words as doctor_words
from tyrecal.report import diagnosis
from tyrecal.report.convergence import draw_convergence, draw_deviations, draw_states
from tyrecal.report.fit import (
    draw_bounds,
    draw_correlations,
    draw_normalised,
    draw_responses,
    normalised,
)
from tyrecal.report.frequencies import draw_load_sweep, draw_pressure_sweep
from tyrecal.report.measured import measured_table
from tyrecal.report.sample import draw_corner
from tyrecal.report.signature import draw_signature
from tyrecal.report.table import MINUS, nearness, shown
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.where import PartChange
from tyrecal.studies.fit.result import FitResult
from tyrecal.studies.loaded_result import LoadSweep
from tyrecal.studies.modes import ModesResult
from tyrecal.studies.result import Column, Deviation, Table
from tyrecal.studies.sample.result import SampleResult
from tyrecal.studies.signature import Signature

from .html import ring, ring_inference, toy
from .test_footprint import rows as pressure_rows
from .test_shape_data import run_of
from .test_table import lines

FIT = FitResult.model_validate(ring.fit())
WITHOUT = {"A_belt": 4e-8, "C10": None}
STATES = FitResult.model_validate(
    ring.fit()
    | {
        "modes": [
            {**mode, "pressure_kPa": kPa, "rim": "fixed", "sigma_Hz": 0.5}
            for kPa in (160.0, 240.0)
            for mode in ring.fit()["modes"]
        ],
        "states": [
            {"pressure_kPa": p, "load_N": 0.0, "rim": "fixed", "standard_errors_without": WITHOUT}
            for p in (160.0, 240.0)
        ],
    }
)


def test_deviations_before_and_after_have_their_signs() -> None:
    (axes,) = draw_deviations(FIT.modes).axes
    series = {line.get_label(): line.get_xdata() for line in axes.lines}
    before = [100 * (mode.initial_Hz / mode.target_Hz - 1) for mode in FIT.modes]
    assert list(series["initial"]) == before and before[0] > 16
    assert list(series["fitted"]) == [mode.deviation_percent for mode in FIT.modes]
    assert FIT.modes[0].deviation_percent == pytest.approx(-2.65, abs=0.01)
    assert axes.yaxis_inverted() and "deviation from target, %" in axes.get_xlabel()


def test_deviations_of_states_stand_in_their_panels() -> None:
    figure = draw_states(STATES)
    assert [axes.get_title("left") for axes in figure.axes] == [
        "160 kPa\nrim fixed",
        "240 kPa\nrim fixed",
    ]
    for axes in figure.axes:
        (bars,) = axes.containers
        points, _, (spread,) = bars.lines
        assert list(points.get_xdata()) == [mode.deviation_percent for mode in FIT.modes]
        halves = [np.ptp(segment[:, 0]) / 2 for segment in spread.get_segments()]
        assert halves == pytest.approx([50 / mode.target_Hz for mode in FIT.modes])
    alone = draw_states(STATES.model_copy(update={"modes": STATES.modes[: len(FIT.modes)]}))
    for axes in (alone.axes[0], figure.axes[0]):
        assert len(axes.get_yticklabels()) == len(FIT.modes)


def test_residuals_are_in_standard_deviations() -> None:
    """Stated with the target or, without one, as the fit leaves them: 1.5 Hz."""
    known = dict(normalised(FIT))
    assert known["[2,0]"] == pytest.approx((79.42 - 79.5) / (0.01 * 79.5))
    assert known["[3,1]"] == pytest.approx((107.9 - 102.7) / 1.5)
    assert known["contact area 4000 N"] == pytest.approx((0.013 - 0.0135) / 2e-4)
    figure = draw_normalised(FIT)
    assert figure and [bar.get_width() for bar in figure.axes[0].containers[0]] == list(
        known.values()
    )
    assert draw_normalised(FIT.model_copy(update={"noise_Hz": None, "footprint": []}))


def test_variables_stand_between_their_bounds() -> None:
    (axes,) = draw_bounds(FIT).axes
    marks = {line.get_marker(): [] for line in axes.lines}
    for line in axes.lines:
        if len(line.get_xdata()) == 1:
            marks[line.get_marker()].append(line.get_xdata()[0])
    # on a logarithmic scale from 1e-7 to 1e-5, and from 0.8 to 10 MPa
    assert marks["o"] == pytest.approx([math.log10(3.6) / 2, 0.0])
    assert marks["s"] == pytest.approx([math.log10(2) / 2, math.log(1 / 0.8) / math.log(12.5)])
    words = [text.get_text() for text in axes.texts]
    assert {"0.1 mm²", "10 mm²", "0.36 mm²", "0.8 MPa, at bound"} <= set(words)


def test_correlations_and_responses_have_their_numbers() -> None:
    figure = draw_correlations(FIT)
    assert figure
    cells, values = ([t.get_text() for t in axes.texts] for axes in figure.axes)
    assert cells == ["1.00", f"{MINUS}0.25", f"{MINUS}0.25", "1.00"]
    assert [float(text) for text in values] == FIT.singular_values
    responses = draw_responses(FIT)
    assert responses and [t.get_text() for t in responses.axes[0].texts] == ["1.2", f"{MINUS}0.5"]


def test_convergence_shows_every_point_and_the_best_so_far() -> None:
    objectives = [33.1, 8.6, None, 9.0, 3.1]
    history = [
        {"point": k, "start": 1, "objective_Hz": each, "values": {"C10": 1e6 / k, "D1": k - 1}}
        for k, each in enumerate(objectives, 1)
    ]
    figure = draw_convergence(history, "Hz")
    above, below = figure.axes[:2]
    ends = {line.get_label(): line.get_ydata() for line in above.lines}
    assert [x for x in ends["best so far"] if math.isfinite(x)][0::4] == [33.1, 3.1]
    points = [x for x in ends["design point"] if math.isfinite(x)]
    assert points == [33.1, 8.6, 9.0, 3.1]
    (ratio,) = (line for line in below.lines if line.get_label() == "C10")
    assert list(ratio.get_ydata()) == pytest.approx([1 / k for k in range(1, 6)])
    (none,) = (line for line in below.lines if line.get_label() == "D1: no ratio")
    assert np.isnan(none.get_ydata()).all()  # it starts from 0
    assert "Hz" in above.get_ylabel() and "33.10 Hz to 3.10 Hz" in figure.get_suptitle()


def test_frequencies_over_load_have_their_values() -> None:
    rows = LoadSweep.model_validate(toy.load_sweep()).rows
    figure = draw_load_sweep(rows)
    hertz = {x for axes in figure.axes for line in axes.lines for x in line.get_ydata()}
    assert {mode.frequency_Hz for row in rows for mode in row.modes} <= hertz
    loads = {x for axes in figure.axes for line in axes.lines for x in line.get_xdata()}
    assert loads == {0.0, 1.0} and figure.axes[-1].get_xlabel() == "load, kN"


def test_a_corner_is_in_engineers_units_and_says_where_a_bound_cuts() -> None:
    content = ring_inference.sample()
    content["variables"]["A_belt"]["lower"] = content["variables"]["A_belt"]["box"][0]
    grid = draw_corner(SampleResult.model_validate(content)).axes
    lowest = [axes for axes in grid if axes.get_xlabel()]
    assert [axes.get_xlabel() for axes in lowest] == ["A_belt, mm²", "angle"]
    ticks = [text.get_text() for text in lowest[0].get_xticklabels()]
    assert ticks == ["0.22\n(cut at bound)", "0.4"]
    lines_at = [line.get_xdata()[0] for line in grid[0].lines if len(set(line.get_xdata())) == 1]
    assert lines_at == [3e-7, 2.2e-7, 4e-7]  # median and 90 %


def test_tables_say_numbers_units_and_how_near() -> None:
    words = nearness([mode.model_dump() for mode in FIT.modes])
    deviations = np.array([mode.deviation_percent for mode in FIT.modes])
    twice = [mode.multiplicity for mode in FIT.modes]
    rms = math.sqrt(np.average(deviations**2, weights=twice))
    assert words.startswith(f"{(abs(deviations) <= 2).sum()} of {len(deviations)} frequencies")
    assert f"rms {rms:.1f} %" in words and f"{max(deviations, key=abs):+.1f} %" in words
    modes = ModesResult.model_validate(toy.loaded_modes())
    text = "\n".join(lines(shown(*modes.tables()), 200))
    assert f"{modes.pressure_kPa:g} kPa, {modes.load_N:g} N, {modes.mass_kg:.2f} kg" in text
    assert all(f"{mode.frequency_Hz:.2f}" in text for mode in modes.modes)


def test_a_deviation_keeps_its_sign_in_tables() -> None:
    table, variables, _, states, *_ = STATES.tables()
    assert states.rows[1][:2] == ["160 kPa, rim fixed", "0"] and states.rows[1][3:] == ["11", None]
    assert variables.rows[0][0] == "A_belt" and variables.rows[0][-1] == "10"
    assert Deviation(FIT.modes[0].deviation_percent, "30.86") == table.rows[0][2]
    text = "\n".join(lines(shown(table), 200))
    assert "30.86 -2.65" in text and MINUS not in text
    nothing = Table([Column("Hz", "")], [[Deviation(-0.001, "30.86")]])
    assert any("30.86 +0.00" in line for line in lines(shown(nothing), 200))


def test_measured_modes_have_hertz_sigma_damping_and_label() -> None:
    text = "\n".join(lines(measured_table([run_of("run.uff")]), 120))
    for words in ("[2,1] member 1", "66.10", "0.100", "2.00", "1.00"):
        assert words in text


def test_bars_of_a_signature_have_their_signs_and_a_legend() -> None:
    before, after = np.array([[5.0, -2.5]]), np.array([[-0.04, np.nan]])
    labels = Label(2, 0), Label(0, 0, "axial")
    given = Signature("bead_filler", 3.0, (240.0,), labels, before, after, 0.886, {}, 0.0)
    figure = draw_signature(given)
    (panel,) = figure.axes
    assert [bar.get_height() for bar in panel.patches[:2]] == [5.0, -2.5]
    texts = [text.get_text() for text in panel.texts if text.get_text()]
    assert texts == ["+5.0", f"{MINUS}2.5", "+0.0", "lost"]
    assert len(figure.legends[0].get_texts()) == 2 and "88.6 %" in figure.get_suptitle()
    assert [each.get_text() for each in panel.get_xticklabels()] == ["[2,0]", "[0,0]\nlateral"]


@pytest.mark.parametrize(
    ("mass", "words"), [(21.0, "mass +21 % ± 8 %"), (2.0, "stiffness +9 % ± 20 %")]
)
def test_the_part_that_serves_best_is_stated_by_what_is_surer(mass: float, words: str) -> None:
    part = PartChange("tread", 9.0, 20.0, mass, 8.0, 4.9, ("belt",))
    d: Any = SimpleNamespace(
        gap=SimpleNamespace(groups=[], contrasts=[]), parts=[part], effective_rank=2
    )
    text = " ".join(diagnosis._where(d))
    assert f"tread (looks the same as belt), {words}, ln evidence +4.9" in text


def test_a_doctors_words_have_records_and_the_known_tyre() -> None:
    mode = {"label": "[0,0] axial", "recorded_Hz": 37.0277}
    check = {"solver": "bundled", "seconds": 1.2, "ok": False, "tolerance_percent": 0.01}
    check["modes"] = [
        {**mode, "frequency_Hz": 37.5, "deviation_percent": 1.275},
        {**mode, "frequency_Hz": None, "deviation_percent": None},
    ]
    machine = {"python": "3.11", "system": "Linux", "cores": 2, "free_disc_GB": 9.5}
    text = "\n".join(
        doctor_words(
            {
                "tyrecal": "0.1",
                "installed_in": "here",
                "machine": {**machine, "free_memory_GB": 3.5, "memory_GB": 8.0},
                "packages": [],
                "extras": [],
                "settings": {"file": None},
                "solvers": [],
                "records": [{"folder": "x/record", "records": 7, "MB": 2.1}],
                "self_check": check,
            }
        )
    )
    assert "2 cores, 3.5 of 8 GB of memory, 9.5 GB" in text
    assert "x/record: 7 evaluations, 2.1 MB" in text
    assert "[0,0] lateral    recorded 37.03, now 37.50 Hz (+1.275 %)" in text
    assert "now not found" in text and "NOT as recorded, within 0.01 %" in text


def test_frequencies_over_pressure_have_values_slopes_and_units() -> None:
    rows = pressure_rows()
    upper, _, lower, _ = draw_pressure_sweep(rows).axes
    hertz = {x for line in upper.lines for x in line.get_ydata()}
    inner = {m.frequency_Hz for row in rows for m in row.modes if m.label.family == "in-plane"}
    assert inner <= hertz
    slopes = {x for line in lower.lines for x in line.get_ydata()}
    assert {m.d_ln_f_d_ln_p for row in rows for m in row.modes if m.label.m == 0 < m.c} <= slopes
    assert (upper.get_ylabel(), lower.get_ylabel()) == ("frequency, Hz", "d ln f / d ln p")
    assert lower.get_xlabel().endswith("pressure, kPa")


def test_what_was_not_computed_under_load_stays_empty() -> None:
    row = SimpleNamespace(
        pressure_kPa=240.0,
        load_N=4e3,
        quantity="contact_area_m2",
        member=None,
        value=0.0125,
        sigma=1.25e-4,
        off={"none": -0.021},
    )
    pressed = SimpleNamespace(
        tyres=["none", "rim_width"],
        rows=[row],
        failed=["rim_width, 4000 N: too much"],
        rms_percent=lambda key: 2.1 if key == "none" else None,
    )
    study: Any = SimpleNamespace(under_load=pressed)
    text = "\n".join(diagnosis._under_load(study))
    assert "calibrated 2.1 %" in text
    assert "| 240 | 4000 | contact area 125.0 cm² ± 1.0 % | -2.1 |  |" in text
    assert "with `rim_width`, 4000 N: too much" in text


@pytest.mark.parametrize(("changes", "words"), [(0, "1 modes at 160, 240 kPa"), (2, ", 3 runs")])
def test_a_diagnosis_counts_modes_pressures_and_runs(changes: int, words: str) -> None:
    rows = [SimpleNamespace(label=Label(2, 0), pressure_kPa=p, rim=None) for p in (240.0, 160.0)]
    rows.append(SimpleNamespace(label=None, pressure_kPa=0.0, rim=None))  # the mass
    observations = SimpleNamespace(rows=rows)
    problem = SimpleNamespace(observations=observations, changes=[None] * changes)
    d: Any = SimpleNamespace(problem=problem, damping_ratios=0)
    text = diagnosis._counted(d)
    assert text.endswith(words) and text.startswith("1 modes at 160, 240 kPa")
