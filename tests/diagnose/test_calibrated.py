"""Calibrated variables in a diagnosis, and the result where there is no gap.

Constants as a diagnosis reports them are those of `sensitivities`, with all of them free.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from tyrecal.report.diagnosis import page
from tyrecal.studies.diagnose.calibrated import calibrated_variables
from tyrecal.studies.diagnose.constants_posterior import constants_posterior
from tyrecal.studies.diagnose.diagnosis import Diagnosis, diagnose
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.diagnose.study import DiagnosedCase
from tyrecal.studies.diagnose.verdict import no_gap_words
from tyrecal.studies.inference.inverse_problem import Assumed
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.sensitivities.selection import likeliest_shifts
from tyrecal.units import in_engineers_units

from ..chance import generator
from .toy import Toy, flat, problem

X = np.array((0.3, -0.2, 0.1))


def exact(toy: Toy, effects: dict[str, float]) -> Diagnosis:
    """Diagnosis of data at X without scatter."""
    base, (answer,) = problem(toy), toy.answers([Query(X, effects)])
    assert isinstance(answer, Answer)
    seen = base.measured(answer.eta[base.places]).observations
    return diagnose(toy, toy.rows, seen, assumed=base.assumed)


def told(d: Diagnosis, toy: Toy) -> str:
    return page(DiagnosedCase(d, (), False, {}, (), toy), "tyre", "a.csv")  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def toy() -> Toy:
    return Toy(effects=3, size=0.03)


@pytest.fixture(scope="module")
def named(toy: Toy) -> Diagnosis:
    return exact(toy, {"e0": 0.8})


@pytest.fixture(scope="module")
def plain(toy: Toy) -> Diagnosis:
    return exact(toy, {})


def test_the_variables_with_the_effect_are_the_truth(toy: Toy, named: Diagnosis) -> None:
    """As near as a standard error: the data have no scatter, the prior and the grid of sizes pull
    a little; a logarithm's scatter is the variable's share."""
    calibrated = calibrated_variables(named, toy)  # type: ignore[arg-type]
    assert named.leading == "e0" and set(calibrated) == {"without", "with"}
    for variable, truth in zip(calibrated["with"].values(), 2 * np.exp(X), strict=True):
        assert variable["unit"] == "Pa" and 0 < variable["standard_error"] < 0.05 * truth
        assert abs(variable["value"] - truth) < variable["standard_error"]
    assert calibrated["without"].keys() == calibrated["with"].keys() == set(toy.variables)
    assert "calibrated" not in diagnosis_result(named).content()
    assert diagnosis_result(named, None, calibrated).content()["calibrated"] == calibrated


def test_the_page_has_them_with_units(toy: Toy, named: Diagnosis) -> None:
    words = told(named, toy)
    assert words.startswith("# What the model of tyre lacks")
    assert "| variable | without an effect | with `e0` |" in words
    rows = re.findall(r"^\| ([ABC]) \| (\S+) MPa ± \S+ % \| (\S+) MPa ± \S+ % \|$", words, re.M)
    assert [name for name, *_ in rows] == list(toy.variables)
    calibrated = calibrated_variables(named, toy)  # type: ignore[arg-type]
    for name, _, value in rows:
        assert float(value) == pytest.approx(1e-6 * calibrated["with"][name]["value"], rel=1e-3)


def test_where_there_is_no_gap_nothing_explains_it(toy: Toy, plain: Diagnosis) -> None:
    """Said once, no effect beside the calibrated variables, none that shrinks an error."""
    assert plain.verdict.kind == "no_gap" and plain.leading is None
    words = told(plain, toy)
    assert words.lower().count(no_gap_words(plain.probabilities["none"])) == 1
    assert "lacks" not in words and "it shrinks by" not in words
    assert "| variable | without an effect |\n" in words
    assert calibrated_variables(plain, toy)["with"] is None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (-0.00934, "m", "-9.34 mm"),
        (2.1e-7, "m2", "0.21 mm²"),
        (1.26e6, "Pa", "1.26 MPa"),
        (3e-7, "m/N", "0.3 mm/kN"),
        (0.25, "", "0.25"),
        (-3.0, "degrees", "-3 degrees"),
    ],
)
def test_sizes_in_the_units_people_say_them_in(value: float, unit: str, words: str) -> None:
    assert in_engineers_units(value, unit, 3) == words


@pytest.mark.parametrize("spread", [1.0, 0.02])
def test_constants_are_their_mean_over_all_tyres_that_fit(spread: float) -> None:
    """Also where the variables are known before, so that they do not absorb all that they could:
    the closed form, by the covariance of deviations at the variables' prior."""
    toy: Any = flat(effects=0, pressures=(160.0, 240.0))
    toy.spread = np.full(3, spread)
    toy.constants *= 3
    base = problem(toy, assumed=Assumed(form=0.001))
    off = toy.constants @ [2.0, -1.5] + toy.J @ np.full(3, 0.5 * spread)
    y = toy.base + off + 0.002 * generator("constants").normal(size=len(toy.base))
    data = base.measured(y).observations
    diagnosis = diagnose(toy, toy.rows, data, assumed=Assumed(form=0.001), ranked=False)
    reported = {each.name: each.shift_in_sd for each in constants_posterior(diagnosis)}
    J = toy.J * toy.spread
    known = base.covariance(data, np.zeros((len(y), 0))) + J @ J.T
    shifts = likeliest_shifts(y - toy.base, known, toy.constants)
    assert list(reported) == sorted(reported, key=lambda name: -abs(reported[name]))
    assert reported == pytest.approx(dict(zip(toy.sources, shifts, strict=True)), abs=1e-3)
