"""No picture cuts a text or prints one over another, however long its words are: what `conftest`
checks of every picture that a test of this folder draws, here of hard cases."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from tyrecal.report.convergence import draw_convergence
from tyrecal.report.figure import headline, new_figure, save
from tyrecal.report.load import draw_load_sweep
from tyrecal.report.pressure import draw_pressure_sweep
from tyrecal.report.section import draw_section
from tyrecal.report.shape_data import section_data
from tyrecal.report.signature import draw_signature
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.loaded_result import LoadRow
from tyrecal.studies.pressure_result import PressureRow
from tyrecal.studies.signature import Signature
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved

from ..conftest import CASES

LABELS = [
    Label(0, 0, "axial"),
    Label(0, 0, "torsional"),
    Label(1, 1),
    Label(1, 0),
    Label(2, 1),
    Label(2, 0),
    Label(3, 0),
    Label(3, 1),
    Label(4, 0),
]


def test_a_cut_text_and_an_overprinted_one_are_seen(tmp_path: Path) -> None:
    """The check itself fails where it should."""

    def drawn(*texts: tuple[float, float, str]) -> Figure:
        figure = new_figure(3.0, 2.0, None)
        for x, y, words in texts:
            figure.text(x, y, words)
        return figure

    save(drawn((0.1, 0.5, "one"), (0.1, 0.2, "other")), tmp_path / "good.png")
    with pytest.raises(AssertionError, match=r"cut by .* pixels: 'one that is too long'"):
        save(drawn((0.8, 0.5, "one that is too long")), tmp_path / "cut.png")
    with pytest.raises(AssertionError, match="'one' and 'other' overlap"):
        save(drawn((0.1, 0.5, "one"), (0.12, 0.52, "other")), tmp_path / "over.png")


@pytest.mark.parametrize("width", [2.5, 4.0, 8.0])
def test_a_headline_takes_the_lines_that_it_needs(width: float, tmp_path: Path) -> None:
    words = "what calibration leaves; bars: one standard deviation; hollow: with an effect"
    figure = new_figure(width, 3.0)
    figure.add_subplot()
    headline(figure, words)
    save(figure, tmp_path / "headline.png")
    title = figure.get_suptitle()
    assert title.split() == words.split()
    assert ("\n" in title) == (width < 8)


@pytest.mark.parametrize(
    "pressures", [(240.0,), pytest.param((160.0, 240.0, 320.0), marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("id", ["temperature_drift", "spindle_torsional", "carcass_fanning"])
def test_signatures(id: str, pressures: tuple[float, ...], tmp_path: Path) -> None:
    assert id in catalogue()
    shape = len(pressures), len(LABELS)
    before = np.linspace(-27.5, 24.2, shape[0] * shape[1]).reshape(shape)
    signature = Signature(
        id, -1.234567e-6, pressures, tuple(LABELS), before, before / 3, 0.886, {}, 0.0
    )
    save(draw_signature(signature), tmp_path / "effect.png")


@pytest.mark.parametrize(
    "designs", [("initial",), pytest.param(("initial", "fitted"), marks=pytest.mark.slow)]
)
def test_crowded_lines_over_the_load(designs: tuple[str, ...], tmp_path: Path) -> None:
    """The modes are within 12 Hz, with both members of each."""
    rows = [
        {
            "design": design,
            "load_N": load,
            "modes": [
                {
                    "c": x.c,
                    "m": x.m,
                    "kind": x.kind,
                    "symmetry": symmetry,
                    "frequency_Hz": 100.0 + k + load / 4000,
                }
                for k, (x, symmetry) in enumerate(product(LABELS, ("symmetric", "antisymmetric")))
            ],
        }
        for design, load in product(designs, (0.0, 4000.0))
    ]
    save(draw_load_sweep([LoadRow(**row, deflection_m=0.0) for row in rows]), tmp_path / "load.png")


@pytest.mark.slow
def test_crowded_lines_over_the_pressure(tmp_path: Path) -> None:
    rows = [
        {
            "design": design,
            "pressure_kPa": kPa,
            "modes": [
                {
                    "c": x.c,
                    "m": x.m,
                    "kind": x.kind,
                    "frequency_Hz": 90 + kPa / 10 + k / 3,
                    "d_ln_f_d_ln_p": 0.4 + k / 1000,
                }
                for k, x in enumerate([*LABELS, Label(1, 2)])
            ],
        }
        for design, kPa in product(("initial", "fitted"), (100.0, 320.0))
    ]
    figure = draw_pressure_sweep([PressureRow(**row) for row in rows], [(Label(2, 0), 240.0, 95.0)])
    save(figure, tmp_path / "pressure.png")


def test_long_names_of_cases_and_variables(tmp_path: Path) -> None:
    case = load_case(CASES / "p235_75r17.yaml")
    name = "LT315/70R17 of the long term test, second batch, on a rim of 9 inches, after run-in"
    layers = {f"{k}_with_a_long_name": v for k, v in case.case.rebar_layers.items()}
    named = case.case.model_copy(update={"name": name, "rebar_layers": layers})
    section = section_data(replace(case, case=named), resolved(case).mesh, {})
    save(draw_section(section, name, 240.0), tmp_path / "section.png")
    values = {"stiffness_of_the_belt_cords_in_the_shoulder": 2.0, "C10": 3.0}
    history = [{"point": k, "objective_Hz": 3 + 30 / k, "values": values} for k in range(1, 9)]
    figure = draw_convergence(history, "deviations in standard deviations")
    save(figure, tmp_path / "fit.png")
