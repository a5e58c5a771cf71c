"""Measurements on the road, against tyres that were fitted without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.measured.measurement import Measurement
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.label import Label
from tyrecal.simulate.modes.loaded import Member
from tyrecal.studies.diagnose.under_load import LoadedRow, UnderLoad, compare
from tyrecal.studies.footprint import footprint_row
from tyrecal.studies.loaded import LoadedTyre, load_tyres
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved

from ..studies.loaded import coarse_case

LOADS = [100.0, 600.0]  # a patch of several elements at the last: its stiffness is no noise
SOFTER = 0.9
AREA, STIFFNESS = "contact_area_m2", "vertical_stiffness_N_per_m"


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> LoadedCase:
    return load_case(coarse_case(tmp_path_factory.mktemp("coarse")))


def true_values(case: LoadedCase) -> dict[str, float]:
    """Values of the tyre that is measured."""
    return {**start_values(case), "C10": SOFTER * start_values(case)["C10"], "pressure_kPa": 220.0}


@pytest.fixture(scope="module")
def readings(case: LoadedCase) -> list[Measurement]:
    """Areas and a stiffness of that tyre; the first area as the mean of two."""
    pressed = Evaluator(TyreDesign(case)).press(true_values(case), LOADS)
    low, high = (footprint_row(pressed, each, resolved(case).mesh) for each in pressed.footprints)
    (first, last), area = LOADS, low["area_m2"]
    rows = [
        (AREA, first, 1.01 * area),
        (AREA, first, 0.99 * area),
        (AREA, last, high["area_m2"]),
        (STIFFNESS, last, high[STIFFNESS]),
    ]
    return [Measurement(q, None, "", 220.0, load, x, 0.02 * x) for q, load, x in rows]


@pytest.mark.slow
def test_the_tyre_itself_is_found(case: LoadedCase, readings: list[Measurement]) -> None:
    tyres = {"none": start_values(case), "it": true_values(case)}
    comparison = compare(case, Evaluator(TyreDesign(case)), readings, tyres)
    assert not comparison.failed
    assert [(row.quantity, row.load_N) for row in comparison.rows] == [
        (AREA, LOADS[0]),
        (AREA, LOADS[1]),
        (STIFFNESS, LOADS[1]),
    ]
    assert comparison.rms_percent("it") == pytest.approx(0, abs=1e-6)
    at_last = comparison.rms_percent("none", LOADS[1])
    assert at_last and at_last > 0.5
    stiffness = comparison.rows[-1]
    assert stiffness.off["none"] < 0  # what was measured is softer
    assert comparison.rows[0].sigma == pytest.approx(
        0.02 / np.sqrt(2) * comparison.rows[0].value, rel=1e-3
    )


@pytest.mark.slow
def test_modes_under_load(case: LoadedCase) -> None:
    """Named by the doublet's member; one that the tyre does not have stays without a value."""
    values = {**start_values(case), "pressure_kPa": 220.0}
    (tyre,) = load_tyres(case, Evaluator(TyreDesign(case)), {"": values}, LOADS[:1]).values()
    assert isinstance(tyre, LoadedTyre)
    hertz = {mode.member: mode.frequency_Hz for mode in tyre.loads[-1].modes}
    wanted = [
        Member(Label(1, 1), "symmetric"),
        Member(Label(2, 0), "antisymmetric"),
        Member(Label(0, 0, "axial"), "antisymmetric"),
    ]
    read = [
        Measurement(
            "frequency_Hz", m.label, m.symmetry, 220.0, LOADS[0], hertz.get(m, 37.0), 0.1, 2
        )
        for m in wanted
    ]
    comparison = compare(case, Evaluator(TyreDesign(case)), read, {"none": start_values(case)})
    off = {row.member: row.off for row in comparison.rows}
    assert [off[m]["none"] for m in wanted[:2]] == pytest.approx([0, 0], abs=1e-6)
    assert not off[wanted[2]]


@pytest.mark.slow
def test_what_cannot_be_pressed_is_said(case: LoadedCase, readings: list[Measurement]) -> None:
    """A splice does not go with a road; no tyre bears 1 MN, but what lies below stays."""
    beyond = replace(readings[0], load_N=1e6)
    spliced = {**true_values(case), "effects.stiffness_splice": 0.1}
    tyres = {"none": start_values(case), "it": spliced}
    comparison = compare(case, Evaluator(TyreDesign(case)), [*readings[:2], beyond], tyres)
    first, second = comparison.rows
    assert set(first.off) == {"none"} and not second.off
    assert comparison.rms_percent("it") is None and comparison.rms_percent("none")
    splice, load = sorted(comparison.failed)
    assert "it, 220 kPa: " in splice and "splice" in splice
    assert "none, 220 kPa: " in load and "no equilibrium" in load


def test_tyres_are_compared_on_the_same_rows() -> None:
    rows = [
        LoadedRow(AREA, None, 240.0, load, 0.01, 1e-4, off)
        for load, off in ((1e3, {"a": 0.03, "b": 0.01}), (2e3, {"a": 0.5}))
    ]
    comparison = UnderLoad(tuple(rows), ("a", "b"), ("b, 240 kPa: no",))
    assert comparison.rms_percent("a") == pytest.approx(3) and comparison.rms_percent(
        "b"
    ) == pytest.approx(1)
    assert comparison.rms_percent("a", 2e3) is None
