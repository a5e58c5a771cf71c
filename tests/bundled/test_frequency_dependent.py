"""Rubber that stiffens with frequency: laws, tangents, self-consistent modes, slopes.

Several materials, of several laws, in one section: masses, states, modes and slopes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tyrecal_solvers.bundled import job as jobs
from tyrecal_solvers.bundled.deck import steps
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck, Tangent
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import harmonics, lanczos
from tyrecal_solvers.bundled.modes.frequency_dependent import SelfConsistent
from tyrecal_solvers.bundled.results import StepResult
from tyrecal_solvers.bundled.section import model
from tyrecal_solvers.bundled.section.laws.polynomial import MooneyRivlin
from tyrecal_solvers.bundled.section.materials import ModulusTable, read_materials
from tyrecal_solvers.errors import RunFailed
from tyrecal_solvers.language.text import DeckError, read_keywords

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.values import with_values

from ..chance import generator
from ..effects.support import CASE, START, decks, frequencies
from . import support
from .support import Rubber

Array = np.ndarray
BETA, REFERENCE = 0.15, 60.0
TABLE = np.array([1.0, 8.0, 1000.0])
POWER = ModulusTable(tuple(TABLE), tuple((TABLE / REFERENCE) ** BETA))


@pytest.mark.numbers
@pytest.mark.parametrize("f", [1.0, 3.7, 8.0, 60.0, 999.0])
def test_a_table_of_a_power_law_is_the_power_law(f: float) -> None:
    assert POWER.ratio(f) == pytest.approx((f / REFERENCE) ** BETA, rel=1e-14)
    if f not in TABLE:
        assert POWER.slope(f) == pytest.approx(BETA, rel=1e-12)


@pytest.mark.numbers
def test_constant_beyond_the_table() -> None:
    assert POWER.ratio(0.1) == POWER.ratio(1.0) and POWER.slope(0.1) == 0.0
    assert POWER.ratio(1e5) == POWER.ratio(1e3) and POWER.slope(1e5) == 0.0


@pytest.mark.numbers
def test_the_tangent_is_linear_in_the_ratio() -> None:
    """A(rho) = A(1) + (rho - 1) dA, dA without the initial stress."""
    rng = generator(0)
    F = np.eye(3) + 0.2 * rng.standard_normal((5, 3, 3))
    full = lambda x: np.full(5, x)
    m = MooneyRivlin(full(1e6), full(2e5), full(2e7))
    shear = replace(m, inverse_D1=full(0.0), stressed=False)
    for rho in (0.7, 2.0):
        stiff = replace(m, shear_ratio=full(rho), bulk_ratio=full(1.0))
        wanted = m.tangent(F) + (rho - 1) * shear.tangent(F)
        np.testing.assert_allclose(stiff.tangent(F), wanted, rtol=1e-9, atol=1e-3)


def tube(law: ModulusTable | None, component: int = 1) -> harmonics.HasModes:
    """Rubber between a fixed hub and a free outside, that can only turn, or move along the axle:
    K is G times a matrix."""
    b = support.block((0.1, 0.3, 6), (0.0, 0.05, 1), True)
    m = support.model_of(support.deck(b.X, b.solids, Rubber(C10=2e5)))
    if law:
        zero = np.zeros(m.parts[0].rows.weights.size, int)
        m = replace(m.with_laws(lambda own: replace(own, table=zero)), tables=[law])
    mask = np.ones((len(b.X), 3), bool)
    mask[:, component] = b.where(0, 0.1)
    vibration = harmonics.Vibration(m, 0 * mask, [], support.numbering(m, mask), 0.0)
    return SelfConsistent(vibration, [law]) if law else vibration


@pytest.mark.numbers
def test_one_spring_in_closed_form() -> None:
    """omega^2 = omega0^2 (f / f_ref)^beta: f = (f0 f_ref^(-beta/2))^(1 / (1 - beta/2)), for
    every mode, to 1e-10."""
    f0 = support.hertz(tube(None).modes(0, 4).eigenvalues)
    frequencies = support.hertz(tube(POWER).modes(0, 4).eigenvalues)
    exact = (f0 * REFERENCE ** (-BETA / 2)) ** (1 / (1 - BETA / 2))
    assert f0[0] < REFERENCE < f0[-1] < 1000.0
    np.testing.assert_allclose(frequencies, exact, rtol=1e-10)
    alone = tube(POWER).modes(0, 1)
    assert support.hertz(alone.eigenvalues) == pytest.approx(exact[:1], rel=1e-10)


@pytest.mark.numbers
def test_waves_that_only_shear_in_closed_form() -> None:
    """The same of waves round the tube that move along the axle alone."""
    f0, frequencies = (support.hertz(tube(law, 2).modes(3, 2).eigenvalues) for law in (None, POWER))
    exact = (f0 * REFERENCE ** (-BETA / 2)) ** (1 / (1 - BETA / 2))
    np.testing.assert_allclose(frequencies, exact, rtol=1e-10)


@pytest.mark.numbers
def test_a_law_that_settles_nowhere_is_a_failure() -> None:
    """A modulus that jumps down faster than the frequency rises has no fixed point to find."""
    f0 = float(support.hertz(tube(None).modes(0, 1).eigenvalues)[0])
    wild = ModulusTable((1.0, 0.999 * f0, f0, 1.001 * f0, 1e4), (1.0, 4.0, 1.0, 0.25, 0.25))
    with pytest.raises(RunFailed):
        for start in (1.0, 2.0, 4.0):
            law = ModulusTable(wild.frequency_Hz, tuple(r * start for r in wild.ratios))
            tube(law).modes(0, 1)


@pytest.mark.numbers
def test_nothing_where_the_ratio_is_one() -> None:
    flat = ModulusTable((1.0, 1000.0), (1.0, 1.0))
    np.testing.assert_allclose(
        tube(flat).modes(0, 3).eigenvalues, tube(None).modes(0, 3).eigenvalues, rtol=1e-12
    )


@pytest.mark.numbers
def test_the_inflated_state_and_the_other_rubbers_stay() -> None:
    """dK acts only where the law does."""
    m = support.model_of(support.tyre((3, 2, 2, 1)).deck)
    (soft,) = replace(m, tables=[POWER]).frequency_dependent_models()
    laws = [part.law for part in soft.parts]
    assert laws and all(isinstance(law, MooneyRivlin) for law in laws)
    assert not any(law.C10.any() or law.inverse_D1.any() for law in laws)


@pytest.mark.numbers
def test_each_rubber_has_its_own_table_or_none() -> None:
    """Three rubbers, two with tables: what grows with either is its own shear modulus alone."""
    b = support.block((0.1, 0.4, 3), (0.0, 0.1, 1), False)
    text = support.deck(b.X, b.solids, Rubber())
    head, _, materials = text.partition("*SOLID SECTION")
    _, _, gum = materials.partition("*MATERIAL, NAME=RUBBER\n")
    for i in (1, 2, 3):
        head += f"*ELSET, ELSET=E{i}\n{i}\n*SOLID SECTION, ELSET=E{i}, MATERIAL=GUM{i}\n"
    table = "*VISCOELASTIC, FREQUENCY=TABULAR\n0., -{0}, 0., 0., 10.\n0., -0.9, 0., 0., 20.\n"
    tables = {1: table.format(0.1), 2: "", 3: table.format(0.2)}
    for i, rows in tables.items():
        head += f"*MATERIAL, NAME=GUM{i}\n{gum}{rows}"
    keywords, _ = steps.check(read_keywords(head), False)
    m = model.build(keywords, None, True, own_frequency=True)
    assert [t.ratios[0] for t in m.tables] == pytest.approx([1.1, 1.2])
    grown = [part.law.C10 for each in m.frequency_dependent_models() for part in each.parts]
    np.testing.assert_allclose(grown, [[1e6, 0, 0], [0, 0, 1e6]])
    assert not model.build(keywords, 15.0, True).tables
    law = model.build(keywords, 15.0, True).parts[0].law
    middle = [np.exp(np.log([x, 1.9]) @ (1 - s, s)) for x in (1.1, 1.2) for s in [np.log2(1.5)]]
    np.testing.assert_allclose(law.shear_ratio, [middle[0], 1, middle[1]])
    assert (law.bulk_ratio == 1).all()


@pytest.mark.numbers
@pytest.mark.slow
def test_self_consistent_as_by_hand_through_the_door() -> None:
    """Each mode of beta = 0.15 about 20 Hz is that of one modulus for all modes, (f / 20)^beta
    times the static one, once f is the mode's own: an independent loop through decks."""
    beta, reference = 0.15, 20.0
    value = {"materials.rubber.reference_frequency_Hz": reference}
    case = with_values(CASE, value)
    direct = frequencies(case, frequency_stiffening=beta)
    for label in list(direct)[::3]:
        f = direct[label] * 1.01
        for _ in range(12):
            last, f = f, frequencies(CASE, dynamic_stiffening=(f / reference) ** beta - 1)[label]
            if abs(f - last) < 1e-9 * f:
                break
        assert direct[label] == pytest.approx(f, rel=1e-8)


@pytest.mark.numbers
def test_a_tilt_about_the_reference_and_no_level() -> None:
    plain, tilted = frequencies(), frequencies(frequency_stiffening=0.1)
    assert list(plain) == list(tilted)  # labels, in order
    for label, f in plain.items():
        assert (tilted[label] > f) == (f > REFERENCE)


@pytest.mark.numbers
@pytest.mark.slow
def test_slopes_carry_the_implicit_term() -> None:
    """d f / d C10, where the modulus follows the frequency that C10 moves, and by the exponent."""
    case = with_values(CASE, {"effects.frequency_stiffening": 0.2})
    names = ("C10", "A_belt", "effects.frequency_stiffening")
    values = {**START, names[2]: 0.2}
    evaluator = Evaluator(TyreDesign(case))
    exact = evaluator.evaluate(Question(values, names)).gradients
    for name in names:
        h = 1e-3 * values[name]
        up, down = (
            np.array([m.frequency_Hz for m in evaluator.evaluate(Question(v)).modes])
            for v in ({**values, name: values[name] + h}, {**values, name: values[name] - h})
        )
        central = (up - down) / (2 * h)
        scale = abs(central).max()
        np.testing.assert_allclose(exact[name], central, rtol=3e-6, atol=3e-6 * scale)


@pytest.mark.numbers
def test_labels_and_multiplicities_as_before() -> None:
    answer = Evaluator(TyreDesign(CASE)).evaluate(
        Question({**START, "effects.frequency_stiffening": 0.1})
    )
    modes = paired_labels(answer.modes)
    assert {(m.label.c > 0) + 1 for m in modes} == {1, 2}
    assert all(m.multiplicity == (2 if m.label.c else 1) for m in modes)
    assert catalogue()["frequency_stiffening"].needs == "frequency_modulus"


@pytest.mark.numbers
@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("0, -0.1, 0, 0, 10", "two rows"),
        ("0, -0.1, 0, 0, 10\n0, -0.2, 0, 0, 10", "rise"),
        ("0, 1.1, 0, 0, 10\n0, -0.2, 0, 0, 20", "positive"),
        ("0, -0.1, 0, 0.5, 10\n0, -0.2, 0, 0, 20", "bulk"),
    ],
)
def test_tables_that_are_none(rows: str, words: str) -> None:
    text = f"*MATERIAL, NAME=GUM\n*VISCOELASTIC, FREQUENCY=TABULAR\n{rows}\n"
    with pytest.raises(DeckError, match=words):
        read_materials(read_keywords(text))


COMPOUNDS = {  # name: law, constants, density
    "SIDEWALL": ("*HYPERELASTIC, YEOH", "400000., -50000., 20000., 1.E-7, 2.E-7", 1120.0),
    "SKIM": ("*HYPERELASTIC, NEO HOOKE", "1200000., 5.E-8", 1130.0),
    "TREAD": ("*HYPERELASTIC, ARRUDA-BOYCE", "1100000., 3., 8.E-8", 1150.0),
    "APEX": ("*HYPERELASTIC, OGDEN, N=2", "3.E6, 2., -2.E5, -2., 3.E-8", 1200.0),
    "WIRE": ("*ELASTIC", "5.E9, 0.3", 4000.0),
}
STEP = 1e-2  # in ln of a number
PLACES = {
    "SIDEWALL": "REGION_LOWER_SIDEWALL",
    "SKIM": "REGION_UPPER_SIDEWALL",
    "TREAD": "REGION_CROWN",
    "APEX": "FILLER",
    "WIRE": "CORE",
}


def compounded() -> dict[str, str]:
    """The coarse tyre's decks, each region of another stuff and half of the bead of wire."""
    written = decks(CASE)
    text = written["inflate.inp"]
    one = "*SOLID SECTION, ELSET=SOLID_1, MATERIAL=RUBBER\n"
    beads = "*ELSET, ELSET=CORE\n1002, 1003, 20002, 20003\n"
    beads += "*ELSET, ELSET=FILLER\n1001, 1004, 20001, 20004\n"
    sections = [f"*SOLID SECTION, ELSET={e}, MATERIAL={m}\n" for m, e in PLACES.items()]
    materials = [
        f"*MATERIAL, NAME={name}\n{law}\n{numbers}\n*DENSITY\n{density}\n"
        for name, (law, numbers, density) in COMPOUNDS.items()
    ]
    assert text.count(one) == 1
    inflate = text.replace(one, beads + "".join([*sections, *materials]))
    return {"inflate": inflate, "modes": written["modes.inp"]}


def run(pair: dict[str, str], **request: object) -> StepResult:
    whole_request = Request(harmonics=[0, 1, 2], modes_per_harmonic=2, **request)  # type: ignore[arg-type]
    return Job(Deck(pair, "modes", "inflate"), whole_request).run()[-1]


def test_each_element_has_its_own_stuff() -> None:
    """A part for each law; each region's mass is its volume times its own density."""
    job = Job(Deck(compounded(), "modes", "inflate"), Request())
    plain = Job(
        Deck({**compounded(), "inflate": decks(CASE)["inflate.inp"]}, "modes", "inflate"), Request()
    )
    solids, before = job.model.parts[:-1], plain.model.parts[0]
    assert [type(part.law).__name__ for part in solids] == [
        "ReducedPolynomial",
        "MooneyRivlin",
        "ArrudaBoyce",
        "Ogden",
        "LinearElastic",
    ]
    assert sum(len(part.connectivity) for part in solids) == len(before.connectivity)
    mass = {tuple(row): m.sum() for row, m in zip(before.connectivity, before.mass, strict=True)}
    for part, (_, _, density) in zip(solids, COMPOUNDS.values(), strict=True):
        for row, own in zip(part.connectivity, part.mass, strict=True):
            assert own.sum() == pytest.approx(mass[tuple(row)] * density / 1100.0, rel=1e-12)


def test_half_the_section_is_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    half = run(compounded())
    monkeypatch.setattr(jobs, "keeps_half_turn", lambda *_: False)
    whole = run(compounded())
    np.testing.assert_allclose(half.U, whole.U, atol=1e-11 * abs(whole.U).max())
    for mine, its in zip(half.modes, whole.modes, strict=True):
        np.testing.assert_allclose(mine.eigenvalues, its.eigenvalues, rtol=1e-9)


@pytest.mark.slow
def test_slopes_by_numbers_of_each_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """d lambda / d ln of a constant of each against differences of fourth order, whose round-off is
    1e-10 of lambda over their step."""
    monkeypatch.setattr(lanczos, "INVERSE_RTOL", 1e-12)  # slopes are as good as shapes
    pair = compounded()
    lines = pair["inflate"].splitlines()
    places = {name: lines.index(numbers) for name, (_, numbers, _) in COMPOUNDS.items()}
    fields = dict.fromkeys(COMPOUNDS, 0) | {"TREAD": 1, "APEX": 1}
    values = {name: float(lines[places[name]].split(",")[fields[name]]) for name in COMPOUNDS}
    tangents: dict[str, list[Tangent]] = {
        name: [("inflate", places[name] + 1, fields[name], values[name])] for name in COMPOUNDS
    }
    result = run(pair, sensitivities=tangents)
    highest = max(each.eigenvalues.max() for each in result.modes)
    for name in COMPOUNDS:
        eigenvalues = []
        for step in (-2, -1, 1, 2):
            own, numbers = list(lines), lines[places[name]].split(",")
            numbers[fields[name]] = repr(values[name] * (1 + step * STEP))
            own[places[name]] = ",".join(numbers)
            moved = run({**pair, "inflate": "\n".join(own) + "\n"})
            eigenvalues.append(np.concatenate([each.eigenvalues for each in moved.modes]))
        wanted = (eigenvalues[0] - 8 * eigenvalues[1] + 8 * eigenvalues[2] - eigenvalues[3]) / (
            12 * STEP
        )
        got = np.concatenate(result.rates[name])
        noise = 1e-10 * highest / STEP
        np.testing.assert_allclose(got, wanted, atol=1e-6 * abs(wanted).max() + noise)
