"""Sentences about a fit: each follows from the numbers that it is about.

No picture cuts a text or prints one over another, however long its words are: what `conftest`
checks of every picture that a test of this folder draws, here of hard cases.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from tyrecal.report.convergence import draw_convergence
from tyrecal.report.diagnosis import _robust
from tyrecal.report.figure import headline, new_figure, save
from tyrecal.report.frequencies import draw_load_sweep, draw_pressure_sweep
from tyrecal.report.section import draw_section
from tyrecal.report.shape_data import section_data
from tyrecal.report.signature import draw_signature
from tyrecal.report.table import fit_doubts, fit_verdict
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.loaded_result import LoadRow
from tyrecal.studies.pressure_result import PressureRow
from tyrecal.studies.signature import Signature
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved

from ..conftest import CASES


def fit(**changes: Any) -> dict[str, Any]:
    """The content of a fit.json, as far as its verdict goes."""
    mode = {"c": 2, "m": 1, "kind": None, "multiplicity": 2, "deviation_percent": 1.0}
    lateral = {"c": 0, "m": 0, "kind": "axial", "multiplicity": 1, "deviation_percent": -4.0}
    variable = {"initial": 1.0, "value": 2.0, "standard_error": 0.2, "at_bound": False}
    content: dict[str, Any] = {
        "pressure_kPa": 240.0,
        "mass_kg": 12.4,
        "objective_Hz": 3.0,
        "objective_unit": "Hz",
        "converged": True,
        "moved": True,
        "failed_evaluations": 0,
        "label_margin": 1.0,
        "variables": {"A": dict(variable), "B": dict(variable)},
        "singular_values": [1.0, 0.5],
        "modes": [dict(mode), lateral],
        "starts": [start()],
    }
    return {**content, **changes}


def start(objective: float = 3.0, A: float = 2.0) -> dict[str, Any]:
    return {"objective_Hz": objective, "values": {"A": A, "B": 2.0}}


def test_how_near_it_came() -> None:
    """The doublet counts twice: sqrt((2 * 1 + 16) / 3) = 2.4 %."""
    words = fit_verdict(fit())
    assert words[0] == "Converged at 240 kPa, 12.40 kg."
    assert words[1] == (
        "1 of 2 frequencies come within 2 % of their targets (rms 2.4 %); farthest off is [0,0]"
        " lateral with -4.0 %."
    )
    assert len(words) == 2 and not fit_doubts(fit())


@pytest.mark.parametrize(
    ("starts", "words"),
    [
        ([start(), start(3.001)], "All 2 starts end here."),
        ([start(), start(3.001), start(9.0)], "2 of 3 starts end here, the others at 9.00 Hz or"),
        ([start(), start(3.001, 3.0)], "2 of 2 starts reach this objective, but with A up to 50 %"),
    ],
)
def test_whether_starts_agree(starts: list[dict[str, Any]], words: str) -> None:
    assert fit_verdict(fit(starts=starts))[-1].startswith(words)


def test_starts_of_a_fit_with_a_prior_are_compared_by_what_it_minimises() -> None:
    """Not by the deviations alone, the objective of the table."""
    starts = [start(1.74), start(1.743), start(1.9, 2.5)]
    words = fit_verdict(fit(starts=starts, prior=True, objective_Hz=10.7))[-1]
    assert words == "2 of 3 starts end here, the others at 1.90 sigma or more."


def test_a_fit_is_judged_by_chi2_per_degree_of_freedom() -> None:
    """The first line has the verdict, a warning the likeliest reason; nothing is judged without
    standard deviations."""
    assert not any("chi2" in each for each in fit_verdict(fit()))
    good = fit(verdict="fits", chi2_per_dof=1.0, reason=None)
    assert fit_verdict(good)[0].startswith("Converged") and not fit_doubts(good)
    assert "chi2 per degree of freedom is 1:" in fit_verdict(good)[-1]
    blind = fit(singular_values=[1.0, 0.0])
    assert "do not determine all" in fit_doubts(blind)[0]
    assert not fit_doubts({**blind, "prior": True})
    bad = fit(verdict="does_not_fit", chi2_per_dof=491.0, reason=None)
    assert fit_verdict(bad)[0] == "Does not fit at 240 kPa, 12.40 kg."
    (doubt,) = fit_doubts(bad)
    assert "DOES NOT FIT: chi2 per degree of freedom is 491" in doubt
    reason = {"kind": "value", "words": "line 2: did you mean 31.7 Hz?", "chi2_per_dof": 1.25}
    (doubt,) = fit_doubts({**bad, "reason": reason})
    assert "reason: line 2: did you mean 31.7 Hz? (chi2 per degree of freedom would be 1.2" in doubt
    assert fit_doubts({**good, "reason": reason}) == [doubt.rpartition("reason: ")[2]]


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (0.9, None),
        (4.0, "hardly determine A: its standard error is 200 %"),
        (None, "do not determine A: fix it"),
    ],
)
def test_variables_that_the_data_do_not_determine(error: float | None, words: str | None) -> None:
    result = fit()
    result["variables"]["A"]["standard_error"] = error
    doubts = fit_doubts(result)
    assert len(doubts) == (words is not None) and all(words in doubt for doubt in doubts if words)


@pytest.mark.parametrize("readings", [1, 2])
def test_a_robust_verdict_mentions_labelings_if_there_are_several(readings: int) -> None:
    robustness = SimpleNamespace(robust=True, low=0.7, high=0.9)
    verdict = SimpleNamespace(key="rim_width", best="rim_width", kind="named")
    d: Any = SimpleNamespace(
        robustness=robustness, verdict=verdict, exchanged=[], readings=[None] * readings
    )
    words = _robust(d)
    assert ("under every likely labeling" in words) == (readings == 2)
    assert "the probability of `rim_width` is between 0.70 and 0.90" in words


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
