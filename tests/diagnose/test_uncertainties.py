"""Constants that may be off: those that the case states, or what is assumed of them.

Errors of the model's form and of material laws: which rows they have in common.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.studies.inference.covariance import covariance, model_form
from tyrecal.studies.inference.inverse_problem import Toggle
from tyrecal.studies.inference.observations import Observable
from tyrecal.studies.inference.uncertainties import (
    DENSITY_PERCENT,
    PRESSURE_kPa,
    sources,
    values_of,
)
from tyrecal.tyre.case.parts import Gauge
from tyrecal.tyre.case.schema import Uncertainty

from ..conftest import CASES
from .coarse_model import CASE
from .toy import LABELS, Toy, problem


def test_sources_of_error_are_those_of_the_case_or_assumed_and_never_calibrated() -> None:
    stated, assumed = sources(CASE)
    assert not assumed and {"pressure", "belt_spacing", "rim_width"} <= {s.name for s in stated}
    tied = next(s for s in stated if s.name == "belt_spacing")
    assert tied.steps == pytest.approx(
        {"rebar_layers.belt_1.spacing_m": 1.16e-5, "rebar_layers.belt_2.spacing_m": 1.16e-5}
    )
    words = {s.name: s.words for s in stated}
    assert words["pressure"] == "pressure 1 kPa" and words["rim_width"] == "rim width 1 mm"
    assert words["belt_1_angle"] == "belt 1 angle 1 degrees"
    assert words["sidewall_gauge"] == "sidewall gauge 0.03"
    bare = replace(CASE, case=CASE.case.model_copy(update={"uncertainties": {}}))
    own_sources, assumed = sources(bare)
    assumed_words = {s.name: s.words for s in own_sources}
    assert assumed and assumed_words["rubber_density"] == f"rubber density {DENSITY_PERCENT:g} %"
    assert set(assumed_words) == {
        "pressure",
        "rubber_density",
        "belt_cord_modulus",
        "carcass_cord_modulus",
        *(f"{layer}_{what}" for layer in CASE.case.rebar_layers for what in ("spacing", "angle")),
    }
    assert assumed_words["pressure"] == f"pressure {PRESSURE_kPa:g} kPa"
    paths = {path for s in (*own_sources, *stated) for path in s.steps}
    assert not paths & {path for v in CASE.case.variables.values() for path in v.sets}
    variable = CASE.case.variables["C10"].model_copy(update={"sets": ["pressure_kPa"]})
    moved = CASE.case.model_copy(update={"variables": {"p": variable}})
    assert "pressure" not in {s.name for s in sources(replace(CASE, case=moved))[0]}


def test_what_is_assumed_of_constants_is_what_the_guide_says() -> None:
    guide = " ".join((CASES / "diagnosis.md").read_text().split())
    assert (
        "densities of rubber 1.5 %, moduli of cords 3 %, spacings 1 %, gauges 3 %, cord angles"
        " 1 degree, pressure 1 kPa"
    ) in guide
    case = CASE
    gauge = Gauge(between=["bead", "upper_sidewall"], factor=2.0)
    section = case.case.section.model_copy(update={"gauges": [gauge]})
    bare = case.case.model_copy(update={"uncertainties": {}, "section": section})
    own_sources, assumed = sources(replace(case, case=bare))
    relative = {"density": 0.015, "modulus": 0.03, "spacing": 0.01}
    assert assumed and len(own_sources) >= 9
    for source in own_sources:
        ((path, step),) = source.steps.items()
        kind = source.name.rpartition("_")[2]
        if kind in relative:
            assert step == pytest.approx(relative[kind] * values_of(case, [source])[path])
            assert source.words.endswith(f" {100 * relative[kind]:g} %")
        elif source.name.startswith("gauge"):
            assert step == pytest.approx(0.06) and path == "section.gauges.0.factor"
        else:
            assert step == 1.0 and (kind == "angle") == path.endswith("angle_deg")
            assert source.words.endswith(" 1 degrees" if kind == "angle" else "pressure 1 kPa")


def test_a_stated_source_moves_its_numbers_as_it_says() -> None:
    """By per cent of each or by so much, up or down together; not what a variable sets."""
    angles = [f"rebar_layers.belt_{k}.angle_deg" for k in (1, 2)]
    density, layers = "materials.rubber.density_kg_per_m3", CASE.case.rebar_layers
    stated = {
        "both_angles": Uncertainty(sets=angles, percent=2.0, signs=[1, -1]),
        "air": Uncertainty(sets=["pressure_kPa"], absolute=3.0, signs=[-1]),
        "stuff": Uncertainty(sets=[density, "materials.rubber.C10_Pa"], percent=1.0),
        "fitted": Uncertainty(sets=["materials.rubber.C10_Pa"], percent=1.0),
        "rim": Uncertainty(sets=["effects.rim_width"], percent=5.0),
    }
    case = replace(CASE, case=CASE.case.model_copy(update={"uncertainties": stated}))
    own_sources, assumed = sources(case)
    by_name = {source.name: (source.words, source.steps) for source in own_sources}
    assert not assumed and list(by_name) == ["both_angles", "air", "stuff", "rim"]
    assert by_name["both_angles"] == (
        "both angles 2 %",
        pytest.approx(
            {
                angles[0]: 0.02 * layers["belt_1"].angle_deg,
                angles[1]: -0.02 * layers["belt_2"].angle_deg,
            }
        ),
    )
    assert by_name["air"] == ("air 3 kPa", {"pressure_kPa": -3.0})
    rho = CASE.case.materials["rubber"].density_kg_per_m3
    assert by_name["stuff"] == ("stuff 1 %", pytest.approx({density: 0.01 * rho}))
    assert by_name["rim"] == ("rim 5 %", {"effects.rim_width": 0.0})  # of what the case has not
    assert values_of(case, own_sources) == {
        **{path: layers[path.split(".")[1]].angle_deg for path in angles},
        "pressure_kPa": CASE.case.pressure_kPa,
        density: rho,
    }


@pytest.mark.numbers
def test_covariance_is_what_it_says() -> None:
    """Model-form error: exp(-ln(1.5)^2 / (2 0.6^2)) between 160 and 240 kPa, 0.97 between runs,
    none between modes."""
    toy = Toy(pressures=(160.0, 240.0))
    p = problem(toy, changes=(Toggle("e0", 0.0),), noise=1e-9)
    S = covariance(p.observations, 0 * p.constants, 0.0, form=0.01) / 1e-4
    n = len(toy.base)
    smooth = np.exp(-(np.log(1.5) ** 2) / (2 * 0.54**2))
    assert S[0, len(LABELS)] == pytest.approx(smooth)
    assert S[0, n] == pytest.approx(0.97)
    assert S[0, n + len(LABELS)] == pytest.approx(0.97 * smooth)
    assert S[0, 1] == 0 and np.linalg.eigvalsh(S).min() > 0


@pytest.mark.numbers
def test_material_laws_are_off_in_all_modes_by_family_and_by_mode_smoothly() -> None:
    """3 % each beside the form on record, 0.4 in ln p apart: exp(-0.4^2 / (2 0.8^2)) alike; [0,0]
    torsional and [1,0] move in the plane, [1,1] does not; a stated form stands for both; the mass
    has neither."""
    toy = Toy(pressures=(160.0, 160.0 * np.exp(0.4)))
    p = problem(toy, noise=1e-9)
    mass = Observable("mass_kg", None, 0.0)
    rows = (*p.observations.rows, mass)
    added = (model_form(rows, 0.03) - model_form(rows, 0.0)) / 0.03**2
    n, near = len(LABELS), np.exp(-(0.4**2) / (2 * 0.8**2))
    names = [str(label) for label in LABELS]
    torsional, lateral, vertical = map(names.index, ("[0,0] torsional", "[1,1]", "[1,0]"))
    assert added[0, 0] == added[n, n] == pytest.approx(3.0)
    assert added[0, n] == pytest.approx(3 * near)
    assert added[vertical, torsional] == added[0, lateral] == pytest.approx(2.0)
    assert added[lateral, vertical] == pytest.approx(1.0)
    assert added[lateral, vertical + n] == pytest.approx(near)
    assert not added[-1].any() and np.linalg.eigvalsh(added).min() > -1e-12
    assert np.array_equal(model_form(rows, 0.03, form=0.01), model_form(rows, 0.0, form=0.01))
