"""Numbers that a fit frees: within what is known of them, and that as a value like others."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.load import load_case
from tyrecal.simulate.evaluate.evaluator import Question
from tyrecal.studies.fit.calibrate import Fit
from tyrecal.studies.fit.free import freed_variables, with_freed, without_freed
from tyrecal.studies.fit.result import FitResult
from tyrecal.studies.fitted import read_fitted
from tyrecal.studies.inference.regions import split_by_region
from tyrecal.tyre.case import LoadedCase, number_at, start_values, with_level
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.case.schema import TargetMode, Targets, Uncertainty
from tyrecal.tyre.values import with_values

from ..conftest import CASES
from ..solved import calibrate
from .fake import LABELS, FakeEvaluator

CASE = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
START = start_values(CASE)
DENSITY, SD = 1100.0, 16.5
NAMES = (*START, "rubber_density")
TRUTH = {"A_belt": 2.4e-7, "A_carcass": 3e-7, "C10": 9e5, "rubber_density": DENSITY + 2 * SD}


def tyre() -> Any:
    turns = 1.0 + np.arange(len(LABELS))
    base = {label: 30.0 + 9.0 * i for i, label in enumerate(LABELS)}
    powers = {name: 0.3 * np.sin(turns * (2 + k)) for k, name in enumerate(NAMES)}
    return FakeEvaluator(base, powers, {**START, "rubber_density": DENSITY})


def case_with(
    sigma: float | None, uncertainties: dict[str, Uncertainty] | None = None
) -> LoadedCase:
    """The case with the frequencies of TRUTH as targets, and with uncertainties of its own."""
    modes = [
        TargetMode(
            c=label.c,
            m=label.m,
            kind=label.kind,  # type: ignore[arg-type]
            frequency_Hz=mode.frequency_Hz,
            sigma_Hz=sigma,
        )
        for label, mode in zip(LABELS, tyre().evaluate(Question(TRUTH)).modes, strict=True)
    ]
    update: dict[str, Any] = {"targets": Targets(modes=modes)}
    update |= {"uncertainties": uncertainties} if uncertainties else {}
    return replace(CASE, case=CASE.case.model_copy(update=update))


def fit(sigma: float, **options: Any) -> Fit:
    return calibrate(with_freed(case_with(sigma), ["rubber_density"]), tyre(), **options)


@pytest.mark.parametrize("method", ["slsqp", "gauss-newton"])
def test_a_planted_number_is_recovered_by_precise_data(method: str) -> None:
    fitted = fit(1e-3, method=method)
    for name, value in TRUTH.items():
        assert fitted.fitted.values[name] == pytest.approx(value, rel=2e-4)
    freed = fitted.found.freed["rubber_density"]
    assert (freed.known, freed.standard_deviation) == (DENSITY, pytest.approx(SD))
    assert freed.shift_in_sd == pytest.approx(2, abs=0.02)
    assert "rubber_density by +2.0" in fitted.found.sentences()[0]
    v = fitted.found.variables["rubber_density"]
    assert (v.lower, v.upper) == pytest.approx((DENSITY - 3 * SD, DENSITY + 3 * SD))
    assert v.unit == "kg/m3" and not fitted.found.fixed


def test_what_is_known_counts_as_a_value_that_was_measured() -> None:
    """At the optimum the sum of squares has no slope, that of the knowledge among them; weak data
    leave the number and its standard error at what is known."""
    point = fit(0.3).fitted
    z = (point.values["rubber_density"] - DENSITY) / SD
    assert 0.1 < z < 1.9  # between what is known and the truth
    assert point.residuals[-1] == pytest.approx(z)
    assert point.jacobian[-1] == pytest.approx([0, 0, 0, point.values["rubber_density"] / SD])
    assert point.jacobian.T @ point.residuals == pytest.approx(np.zeros(4), abs=1e-2)
    weak = fit(100.0).found
    assert weak.freed["rubber_density"].shift_in_sd == pytest.approx(0, abs=0.02)
    assert weak.variables["rubber_density"].standard_error == pytest.approx(SD, rel=0.02)
    assert weak.objective_unit == "sigma" and len(weak.modes) == len(LABELS) and not weak.others


def test_a_number_stays_within_three_standard_deviations() -> None:
    truth = {**TRUTH, "rubber_density": DENSITY + 5 * SD}
    modes = tyre().evaluate(Question(truth)).modes
    case = case_with(1e-3)
    targets = [
        target.model_copy(update={"frequency_Hz": mode.frequency_Hz})
        for target, mode in zip(case.case.targets.modes, modes, strict=True)
    ]
    update = {"targets": Targets(modes=targets)}
    case = replace(case, case=case.case.model_copy(update=update))
    found_by_fit = calibrate(with_freed(case, ["rubber_density"]), tyre()).found
    assert found_by_fit.freed["rubber_density"].shift_in_sd == pytest.approx(3)
    assert found_by_fit.variables["rubber_density"].at_bound


def test_numbers_are_freed_by_name_or_path_and_those_alike_together() -> None:
    path = "materials.rubber.density_kg_per_m3"
    for names in (["rubber_density"], [path], [path, "rubber_density"]):
        assert list(freed_variables(with_freed(CASE, names))) == ["rubber_density"]
    (both,) = freed_variables(with_freed(CASE, ["rebar_layers.belt_2.spacing_m"])).values()
    assert both.sets == [f"rebar_layers.belt_{k}.spacing_m" for k in (1, 2)]
    angles = [f"rebar_layers.belt_{k}.angle_deg" for k in (1, 2)]
    (angle,) = freed_variables(with_freed(CASE, ["belt_1_angle"])).values()
    assert (angle.start, angle.lower, angle.upper, angle.sd) == (70.0, 67.0, 73.0, 1.0)
    apart = Uncertainty(sets=[angles[0], angles[1]], absolute=2.0, signs=[1, -1])
    case = case_with(None, {"belts": apart})
    (belts,) = freed_variables(with_freed(case, ["belts"])).values()
    assert (belts.start, belts.upper, belts.numbers(71.0)) == (70.0, 76.0, [71.0, 109.0])
    moved = with_values(with_freed(case, ["belts"]), {"belts": 71.0})
    assert [number_at(moved, path) for path in angles] == [71.0, 109.0]
    wide = Uncertainty(sets=["materials.rubber.density_kg_per_m3"], percent=50.0)
    (v,) = freed_variables(with_freed(case_with(None, {"wide": wide}), ["wide"])).values()
    assert v.lower == pytest.approx(DENSITY / 1.5**3) and v.scale == "log"  # no density is below 0
    assert v.upper == pytest.approx(2.5 * DENSITY)
    (none,) = freed_variables(with_freed(CASE, ["tread_gauge"])).values()
    assert (none.scale, none.start, none.upper) == ("linear", 0.0, pytest.approx(0.09))
    assert tyre_sha256(without_freed(with_freed(CASE, [path]))) == tyre_sha256(CASE)


def test_a_share_of_nothing_is_refused() -> None:
    none = Uncertainty(sets=["materials.rubber.C01_Pa"], percent=5.0)
    with pytest.raises(InputError, match="none is stated in percent of a number that is 0"):
        with_freed(case_with(None, {"none": none}), ["none"])


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("rubber_densty", "no uncertain number 'rubber_densty'; did you mean 'rubber_density'"),
        ("C10", "C10 is a variable of the case"),
        ("rebar_layers.belt_1.area_m2", "is set by the variable 'A_belt'"),
        ("road.friction", "nothing is known of road.friction: state its standard deviation"),
        ("section", "no uncertain number 'section'"),
    ],
)
def test_what_cannot_be_freed_is_refused_in_one_sentence(name: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as refused:
        with_freed(CASE, [name])
    assert "\n" not in str(refused.value)


def test_numbers_of_a_compound_move_in_every_part_that_is_made_of_it() -> None:
    """As the section is split for its uncertain compounds."""
    angles = [f"rebar_layers.belt_{k}.angle_deg" for k in (1, 2)]
    path = "materials.rubber.density_kg_per_m3"
    both = Uncertainty(sets=[path, *angles], absolute=2.0, signs=[1, 1, -1])
    case = with_freed(case_with(None, {"both": both}), ["both"])
    split, parts = split_by_region(case)
    moved = with_values(split, {"both": DENSITY + 1.0})
    copies = [part for part in parts if part.startswith("part_")]
    assert len(copies) > 3
    for material in ("rubber", *copies):
        assert number_at(moved, f"materials.{material}.density_kg_per_m3") == DENSITY + 1.0
    assert [number_at(moved, each) for each in angles] == [71.0, 109.0]


def test_a_fitted_design_has_its_freed_numbers_by_path(tmp_path: Path) -> None:
    content = fit(0.3).found.stamped({**PROVENANCE, "tyre_sha256": tyre_sha256(CASE)}).content()
    (tmp_path / "fit.json").write_text(json.dumps(content))
    values, _ = read_fitted(tmp_path / "fit.json", CASE)
    fitted = FitResult.model_validate(content)
    assert values == {
        **{name: fitted.variables[name].value for name in START},
        "materials.rubber.density_kg_per_m3": fitted.variables["rubber_density"].value,
    }


PROVENANCE = {
    "tyrecal": "1",
    "solver": "fake",
    "solver_version": "1",
    "name": "a",
    "size": "b",
    "overrides": {},
    "state": {"pressure_kPa": 240.0, "load_N": 0.0, "rim": "fixed"},
    "mesh": "coarse",
}
