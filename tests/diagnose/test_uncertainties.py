"""Constants that may be off, and splits of pairs: stated by the case, or assumed.

The error of form on record is the one that its studies find.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.integrate import trapezoid

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.covariance import (
    FORM_LENGTH,
    OTHERS,
    PERCENT,
    at_pressures,
    covariance,
    form_error,
    model_form,
)
from tyrecal.studies.inference.inverse_problem import Toggle
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.separability import Separability, smallest
from tyrecal.studies.inference.splits import Splits
from tyrecal.studies.inference.uncertainties import (
    DENSITY_PERCENT,
    PRESSURE_kPa,
    sources,
    values_of,
)
from tyrecal.tyre.case.parts import Gauge
from tyrecal.tyre.case.schema import Uncertainty

from ..chance import Chance, generator
from ..conftest import CASES
from ..studies import material_laws
from ..studies.form_error import FLOOR, PRESSURES, alike_over, computed
from ..studies.form_error import LABELS as FORM_LABELS
from .coarse_model import CASE
from .toy import LABELS, Toy, problem

Array = np.ndarray


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


PRESSURES_kPa = (160.0, 240.0, 320.0)


def observed(s: Array, tau: Array | float) -> Observations:
    """Splits (pairs, states), NaN where none was measured; each pair has a label of its own."""
    rows = tuple(
        Observable("frequency_Hz", Label(c, 0), p)
        for c in range(1, len(s) + 1)
        for p in PRESSURES_kPa[: s.shape[1]]
    )
    tau = np.where(np.isnan(s), np.nan, tau).ravel()
    zero = np.zeros(s.size)
    return Observations(rows, zero, zero, 0.0, s.ravel(), tau)


def by_signs(s: Array, apart: Array, tau: Array, width: float) -> tuple[float, float]:
    """ln p, and s^T C^-1 s on the mean over signs, of one pair by its 2^k signs."""
    C = np.diag(tau**2) + width**2
    r = np.array(list(product((1, -1), repeat=len(s)))) * s - apart
    squares = np.einsum("pk,kl,pl->p", r, np.linalg.inv(C), r)
    weight = np.exp(-(squares - squares.min()) / 2)
    ln = np.logaddexp.reduce(-squares / 2) - np.linalg.slogdet(2 * np.pi * C)[1] / 2
    return float(ln), float(weight @ squares / weight.sum())


def test_one_split_is_folded_normal() -> None:
    """s = |N(apart, tau^2 + w^2)|, which integrates to 1."""
    ln = lambda s, apart: Splits.of(observed(np.array([[s]]), 0.004), 0.003).ln_likelihood(
        np.array([[apart]])
    )
    tau = 0.005
    for s, apart in ((0.0, 0.0), (0.01, 0.004), (0.003, 0.012), (0.08, 0.0)):
        terms = [-(((s - x) / tau) ** 2) / 2 for x in (apart, -apart)]
        wanted = np.logaddexp(*terms) - np.log(tau * np.sqrt(2 * np.pi))
        assert ln(s, apart) == pytest.approx([wanted], rel=1e-6)
    grid = np.linspace(0, 0.06, 2001)
    total = trapezoid([np.exp(ln(s, 0.004)[0]) for s in grid], grid)
    assert total == pytest.approx(1, abs=1e-3)
    none = Splits.of(observed(np.array([[0.05, 0.001]]), 0.004), 0.0)
    assert none.chi2() == pytest.approx((0.05**2 + 0.001**2) / 16e-6)
    one = Splits.of(observed(np.array([[0.01]]), 0.004), 0.003)
    assert one.chi2() == pytest.approx(0.01**2 / 25e-6) and one.count == 1


@pytest.mark.parametrize("tau", [3e-4, 2.8e-3])
@pytest.mark.parametrize("width", [3e-3, 3e-4, 1e-6])
def test_several_states_share_the_tyre_s_own_split_over_all_signs(tau: float, width: float) -> None:
    """Every pair of signs by itself; a pair that misses a state; effects of two sizes."""
    random = generator("splits", int(1e5 * tau), int(1e7 * width))
    s = abs(width * random.normal(size=(4, 1)) + tau * random.normal(size=(4, 3)))
    s[1, 2] = np.nan
    taus = tau * random.uniform(1, 2, s.shape)
    apart = abs(random.normal(0, 2 * width, (2, s.size)))
    splits = Splits.of(observed(s, taus), width)
    known = np.isfinite(s)
    assert splits.count == known.sum() == 11
    wanted = [
        sum(
            by_signs(s[i, k], each.reshape(s.shape)[i, k], taus[i, k], width)[0]
            for i, k in enumerate(known)
        )
        for each in apart
    ]
    assert splits.ln_likelihood(apart) == pytest.approx(wanted, rel=1e-6)
    same = np.tile(apart[:1], (3, 1))
    assert splits.ln_likelihood(same) == pytest.approx([wanted[0]] * 3, rel=1e-6)
    squares = [by_signs(s[i, k], 0 * s[i, k], taus[i, k], width)[1] for i, k in enumerate(known)]
    assert splits.chi2() == pytest.approx(sum(squares), rel=1e-5)


def test_a_split_that_is_the_same_everywhere_is_no_threefold_evidence() -> None:
    """1 % at three pressures is the tyre's own: chi2 10.7, of one 10.0; 30 if each counted."""
    own = lambda count: Splits.of(observed(np.full((1, count), 0.01), 1e-3), 3e-3).chi2()
    assert own(1) == pytest.approx(10.0) and own(3) == pytest.approx(10.7, abs=0.1)


def test_splits_count_as_many_as_they_are_on_the_mean(chance: Chance) -> None:
    """400 tyres of two pairs in three states. False failures: 1e-7."""
    width, tau = 3e-3, 2e-3
    values = []
    for _ in range(400):
        own, noise = chance.random.normal(size=(2, 1)), chance.random.normal(size=(2, 3))
        values.append(Splits.of(observed(abs(width * own + tau * noise), tau), width).chi2())
    chance.mean(values, 6.0, 6.0)


def test_pairs_of_which_one_member_was_measured_say_nothing() -> None:
    none = Splits.of(observed(np.full((2, 3), np.nan), 1e-3), 3e-3)
    assert none.count == 0 and none.chi2() == 0.0
    assert none.ln_likelihood(np.zeros((2, 6))).tolist() == [0.0, 0.0]


def judged(distances: np.ndarray, **lambdas: float) -> Separability:
    sizes = dict.fromkeys(lambdas, 1.0)
    return Separability(tuple(lambdas), sizes, lambdas, lambdas, distances, {})


def test_effects_are_linked_by_what_stands_between_them() -> None:
    """a is near b, b near c, c near d, each from one side alone: one group; e is by itself, and f,
    which nothing shows, links nothing."""
    far = np.full((6, 6), 45.0)
    for i, j in ((1, 0), (1, 2), (3, 2), (4, 5), (5, 0)):
        far[i, j] = 4.5
    separability = judged(far, a=20.0, b=20.0, c=20.0, d=20.0, e=20.0, f=4.5)
    assert [sorted(group) for group in separability.groups()] == [["a", "b", "c", "d"]]


def test_at_the_limits() -> None:
    """delta^2 = 9 is apart, lambda = 9 is seen."""
    just = np.array([[0.0, 9.0], [9.0, 0.0]])
    assert judged(just, a=9.0, b=9.0).groups() == []
    assert judged(np.nextafter(just, 0), a=9.0, b=9.0).groups() == [["a", "b"]]


def test_thesmallest_that_is_seen() -> None:
    """lambda grows as the square: 10 is reached at sqrt(10 / a), nearest to 0 on either side; None
    where the whole range stays below."""
    grid = np.linspace(0.0, 2.0, 81)
    assert smallest(grid, 1000 * grid**2) == pytest.approx(0.1)
    assert smallest(grid, 40 * grid**2) == pytest.approx(0.5)
    assert smallest(grid, 2.4 * grid**2) is None
    assert smallest(grid, 2.5 * grid**2) == pytest.approx(2.0)
    both = np.linspace(-2.0, 2.0, 81)
    assert smallest(both, np.where(both < 0, 90, 40) * both**2) == pytest.approx(-1 / 3)


@pytest.mark.slow
def test_what_is_on_record_is_what_the_study_finds() -> None:
    """To the digits that are on record."""
    percent, length = computed()
    assert percent == pytest.approx(PERCENT, abs=0.006)
    assert length == pytest.approx(FORM_LENGTH, abs=0.006)


def test_what_laws_do_falls_into_what_is_shared_and_what_is_not() -> None:
    """Five of the plane and four out of it at two pressures: a shift of all, of the plane's beside
    it and of one mode beside both come back as those, orthogonal to each other."""
    labels = [label for label in FORM_LABELS if label.c <= 4][:9]
    inside = np.array([label.family == labels[1].family for label in labels])
    all_modes, family = np.array([[0.01], [0.02]]), np.where(inside, 1.0, -inside.sum())
    family[~inside] /= (~inside).sum()
    own = np.zeros(len(labels))
    own[np.flatnonzero(inside)[:2]] = 1e-3, -1e-3
    d = all_modes + 1e-3 * family + own
    parts = material_laws.parts(d, labels)
    for part, made in zip(parts, (all_modes + 0 * family, 1e-3 * family, own), strict=True):
        assert part == pytest.approx(np.broadcast_to(made, d.shape), abs=1e-12)


def test_a_deck_s_rubber_gets_another_law() -> None:
    text = "*MATERIAL\n*HYPERELASTIC, {}, MODULI=LONG TERM\n{}\n*END STEP\n"
    softening = material_laws.with_law("YEOH", lambda C, D1: (C, -0.3 * C, D1))
    plain = text.format("MOONEY-RIVLIN", "6e5, 0.0, 5e-8")
    assert softening(plain) == text.format("YEOH", "600000, -180000, 5e-08")


def test_errors_that_are_drawn_with_a_length_have_it() -> None:
    """20000 modes of an error smooth over 0.8 of ln p: rho is right to 1 %, and the length,
    which the largest of - ln rho tells, to 2 %. One that grows twofold from the first pressure to
    the last, and else stays what it is, has rho = 2 * 2 / (1 + 4) between the two."""
    p = np.array(PRESSURES)
    root = np.linalg.cholesky(at_pressures(p, 0.8))
    assert alike_over(root @ generator("lengths").normal(size=(3, 20_000))) == pytest.approx(
        0.8, rel=0.02
    )
    grown = np.array([[1.0], [1.5], [2.0]])
    far, rho = np.log(p[[1, 2, 2]] / p[[0, 1, 0]]) ** 2 / 2, np.array([3 / 3.25, 6 / 6.25, 0.8])
    assert alike_over(grown) == pytest.approx(np.sqrt(far @ far / (far @ -np.log(rho))))
    assert at_pressures(p, 0.8)[0, 2] == pytest.approx(np.exp(-(np.log(2) ** 2) / (2 * 0.8**2)))


def test_a_mode_has_its_own_error_or_the_worst() -> None:
    assert set(PERCENT) == {str(label) for label in FORM_LABELS}
    assert max(PERCENT.values()) == OTHERS and min(PERCENT.values()) >= FLOOR
    assert form_error(Label(2, 1)) == pytest.approx(PERCENT["[2,1]"] / 100)
    assert form_error(Label(9, 0)) == OTHERS / 100 and form_error(None) == 0.0
