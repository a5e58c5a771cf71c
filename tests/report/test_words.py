"""Sentences about a fit: each follows from the numbers that it is about."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from tyrecal.report.diagnosis import _robust
from tyrecal.report.table import fit_doubts, fit_verdict


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
