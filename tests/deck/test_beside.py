"""Decks of a rim that moves, of gas in the cavity, and of rubber with losses or over frequency."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.bundled.job import run
from tyrecal_solvers.errors import Refused
from tyrecal_solvers.language.text import DeckError, read_keywords

import tyrecal
from tyrecal.cli.main import main
from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import DeckRefused
from tyrecal.simulate.evaluate.solver import find_solver
from tyrecal.studies import modes
from tyrecal.tyre.case import CaseError, LoadedCase, start_values
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values

from ..effects.support import CASE, START, decks, frequencies

SOFT = {
    "rim.spindle.lateral_m_per_N": 1e-7,
    "rim.spindle.radial_m_per_N": 5e-8,
    "rim.spindle.torsional_rad_per_N_m": 1e-6,
    "rim.spindle.tilt_rad_per_N_m": 2e-6,
}


RIM = {"rim.mass_kg": 15.0, "rim.polar_inertia_kg_m2": 0.43, "rim.diametral_inertia_kg_m2": 0.27}


def gradient(values: dict[str, float], name: str, step: float = 1e-3) -> tuple[np.ndarray, ...]:
    """Exact d Hz / d ln of a number, and its central difference."""
    evaluator, at = Evaluator(TyreDesign(CASE)), values[name]
    exact = np.array(evaluator.evaluate(Question(values, (name,))).gradients[name]) * at

    def hertz(by: float) -> np.ndarray:
        modes = evaluator.evaluate(Question({**values, name: at * (1 + by)})).modes
        return np.array([m.frequency_Hz for m in modes])

    return exact, (hertz(step) - hertz(-step)) / (2 * step)


@pytest.mark.parametrize(
    "name",
    [
        *SOFT,
        *RIM,
        "pressure_kPa",
        "C10",
        "effects.rim_width",  # moves the nodes that the rim carries
    ],
)
def test_slopes_with_a_rim_on_springs(name: str) -> None:
    values = {**START, **SOFT, "pressure_kPa": 160.0, "effects.rim_width": 0.004}
    exact, central = gradient({name: RIM.get(name, 0.0), **values}, name)
    assert abs(central).max() > 1e-3
    np.testing.assert_allclose(exact, central, rtol=1e-5, atol=1e-5 * abs(central).max())


@pytest.mark.parametrize("name", ["cavity.share", "cavity.temperature_C", "pressure_kPa", "C10"])
def test_slopes_with_air(name: str) -> None:
    """The gas follows the case's pressure and temperature; the wheel moves as well."""
    air = {"cavity.share": 1.0, "cavity.temperature_C": 25.0}
    values = {**START, **SOFT, **air, "pressure_kPa": 160.0}
    exact, central = gradient(values, name)
    assert abs(central).max() > 1e-3
    np.testing.assert_allclose(exact, central, rtol=1e-5, atol=1e-5 * abs(central).max())


def test_a_free_wheel_shows_no_rigid_motions() -> None:
    """The deck asks for modes from 1 Hz on, about a shift below zero: as many as of a fixed one."""
    free = frequencies(wheel_free=1 / 15)
    assert set(free) == set(frequencies())
    assert min(free.values()) > 30.0
    text = decks(CASE, wheel_free=1 / 15)["modes.inp"]
    assert re.search(r"\n20, 1, , -100\n\*BOUNDARY, OP=NEW\n\*FILE FORMAT", text)


def test_a_heavy_free_wheel_stands_still() -> None:
    plain, heavy = frequencies(), frequencies(wheel_free=1e-7)
    for label, f in plain.items():
        assert heavy[label] == pytest.approx(f, rel=1e-5)


def test_n_2_and_more_do_not_know_the_wheel() -> None:
    plain, soft = frequencies(), frequencies(with_values(CASE, SOFT))
    for label, f in plain.items():
        if label.c >= 2:
            assert soft[label] == pytest.approx(f, rel=1e-9)
        else:
            assert soft[label] < 0.999 * f


def test_other_gases() -> None:
    """Helium is lighter, SF6 heavier, in proportion to 1/R; a pressure rise counts as absolute."""
    text = {}
    for gas in ("air", "helium", "sulphur_hexafluoride"):
        cavity = CASE.case.cavity.model_copy(update={"gas": gas, "share": 1.0})
        case = CASE.case.model_copy(update={"cavity": cavity})
        block = Decks(TyreDesign(LoadedCase(**{**CASE.__dict__, "case": case}))).texts("abaqus")[
            "inflate.inp"
        ]
        numbers = re.search(r"MEDIUM, BULK MODULUS\n(\S+)\n\*DENSITY\n(\S+)", block)
        text[gas] = [float(x) for x in numbers.groups()]
    bulk, density = text["air"]
    p = 160e3 + 101325
    assert bulk == pytest.approx(1.4 * p) and density == pytest.approx(p / 287.05 / 293.15)
    assert np.sqrt(bulk / density) == pytest.approx(343.2, abs=0.1)
    assert text["helium"][1] == pytest.approx(density * 4.003 / 28.97, rel=1e-3)
    assert text["sulphur_hexafluoride"][1] == pytest.approx(density * 146.05 / 28.97, rel=2e-3)
    assert np.sqrt(np.divide(*text["sulphur_hexafluoride"])) == pytest.approx(135, abs=1.5)


def test_prony_level_and_exponent_make_one_table() -> None:
    """The table's level is that of the Prony series at the vibration frequency. The inflated
    state has the series' relaxed modulus, however the constants are given."""
    values = {"analysis.vibration_frequency_Hz": 100.0}
    both = with_values(CASE, {**values, "materials.rubber.frequency_exponent": 1e-9})
    assert frequencies(both) == pytest.approx(frequencies(with_values(CASE, values)), rel=1e-7)
    assert "PRONY" not in Decks(TyreDesign(both)).texts("abaqus")["inflate.inp"]


@pytest.mark.parametrize(
    ("values", "solver", "words"),
    [
        ({"cavity.share": 1.0}, "abaqus", "cannot express the gas in the cavity"),
        ({"materials.rubber.frequency_exponent": 0.1}, "abaqus", "each mode's frequency"),
        (SOFT, "calculix", "cannot express a rim that moves"),
    ],
)
def test_solvers_that_cannot(values: dict[str, float], solver: str, words: str) -> None:
    with pytest.raises(DeckRefused, match=words):
        Evaluator(TyreDesign(with_values(CASE, values)), solver).evaluate(Question({}))


def test_abaqus_has_keywords_for_a_rim_that_moves() -> None:
    assert "spindle" in find_solver("abaqus").capabilities


def run_deck(folder: Path, *edits: tuple[str, str]) -> None:
    texts = Decks(TyreDesign(resolved(with_values(CASE, SOFT)).written)).texts("abaqus")
    for name, text in texts.items():
        for old, new in edits:
            text = text.replace(old, new)
        (folder / name).write_text(text)
    assert any(new in (folder / name).read_text() for name in texts for _, new in edits)
    run(folder, "modes", "inflate")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("*BOUNDARY, OP=NEW\n", "*BOUNDARY, OP=NEW\n900001, 1, 1\n", r"1 and 3, .* free together"),
        ("SPINDLE_RADIAL_1\n1\n", "SPINDLE_RADIAL_1\n3\n", "must be alike"),
        ("999000001, 900001", "999000001, 1001", "not honoured together"),
        ("*MASS, ELSET=WHEEL_MASS", "*MASS, ELSET=WHEEL", "no set of MASS elements"),
        ("0.27, 0.43, 0.27", "0.27, 0.43, 0.26", "body of revolution"),
        ("*MASS, ELSET=WHEEL_MASS\n15", "*MASS, ELSET=WHEEL_MASS\n-15", "not negative"),
        ("900001, 0, 0\n", "900001, 0.01, 0\n", "must be on the axle"),
        ("WELL, SPOS", "WELL, SNEG", "SPOS"),
        ("*MASS, ELSET", "*MASS, ALPHA=1.0, ELSET", "MASS: the parameter ALPHA is not honoured"),
    ],
)
def test_decks_that_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(DeckError, match=words):
        run_deck(tmp_path, (old, new))


@pytest.mark.parametrize(
    ("cavity", "words"),
    [
        ('{"material": "RUBBER", "surfaces": ["CAVITY"]}', "no \\*ACOUSTIC MEDIUM"),
        ('{"material": "CAVITY_GAS", "surfaces": ["HOLE"]}', "HOLE"),
        ('{"material": "CAVITY_GAS", "surfaces": []}', "surfaces is .., must have at least 1"),
    ],
)
def test_cavities_that_are_refused(tmp_path: Path, cavity: str, words: str) -> None:
    (tmp_path / "modes.request.json").write_text(f'{{"cavity": {cavity}}}')
    for name, text in (
        Decks(TyreDesign(with_values(CASE, {"cavity.share": 1.0}))).texts("abaqus").items()
    ):
        (tmp_path / name).write_text(text)
    with pytest.raises(Refused, match=words):
        run(tmp_path, "modes", "inflate")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("z: 0.0}", "z: 0.0}\n  free: true\n  spindle: {tilt_rad_per_N_m: 1e-6}", "must be false"),
        ("{r: 0.0", "{r: 0.1", "must have r = 0"),
        ("z: 0.0}", "z: 0.0}\n  spindle: {lateral_m_per_N: -1e-6}", "must be at least 0"),
        ("z: 0.0}", "z: 0.0}\n  spindle: {lateral: 1e-6}", "lateral_m_per_N"),
        ("rim:", "cavity: {gas: argon}\nrim:", "must be"),
        ("density_kg_per_m3: 1100.0", "density_kg_per_m3: 1e3\n    frequency_exponent: 2", "0.5"),
    ],
)
def test_case_files_that_are_wrong(case_folder: Path, old: str, new: str, words: str) -> None:
    path = case_folder / "p235_75r17.yaml"
    text = path.read_text().replace(old, new, 1)
    if "r: 0.1" in text:
        text = text.replace("z: 0.0}", "z: 0.0}\n  free: true")
    path.write_text(text)
    with pytest.raises(CaseError, match=words):
        load_case(path)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"effects.wheel_free": 0.05, "effects.spindle_tilt": 1e-6}, "a free wheel has no spindle"),
        ({"effects.spindle_radial": -1e-9}, "must be at least 0"),
        ({"effects.wheel_free": -0.01}, "must be at least 0"),
        ({"effects.cavity_air": -0.1}, "cavity_air"),
        ({"effects.frequency_stiffening": 0.6}, "frequency_stiffening"),
    ],
)
def test_effects_that_cannot_be(values: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        with_values(CASE, values)


CASE_FILE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"


LOSSLESS = "    density_kg_per_m3: 1100.0"


def with_loss(folder: Path, loss: str, **values: float) -> LoadedCase:
    """The example, coarse, its rubber with a loss factor."""
    path = folder / CASE_FILE.name
    text = CASE_FILE.read_text().replace(LOSSLESS, f"    loss_factor: {loss}\n{LOSSLESS}")
    path.write_text(text)
    (folder / "p235_75r17.csv").write_text(CASE_FILE.with_suffix(".csv").read_text())
    return with_values(tyrecal.load_case(path, mesh="coarse"), values)


def result(case: LoadedCase) -> modes.ModesResult:
    return modes.run(case, Evaluator(TyreDesign(case)), start_values(case))[0]


def test_a_constant_is_a_keyword_and_changes_no_frequency(tmp_path: Path) -> None:
    plain = tyrecal.load_case(CASE_FILE, mesh="coarse")
    lossy = with_loss(tmp_path, "0.2")
    texts = [Decks(TyreDesign(case)).texts("abaqus") for case in (plain, lossy)]
    line = "*DAMPING, STRUCTURAL=0.2\n"
    assert line in texts[1]["inflate.inp"]
    assert not findings(read_keywords(texts[1]["inflate.inp"]))  # ABAQUS's rules
    heads = [text["inflate.inp"].partition("*HEADING")[2] for text in texts]
    assert heads[0] == heads[1].replace(line, "")
    before, after = result(plain), result(lossy)
    pairs = list(zip(before.modes, after.modes, strict=True))
    assert [a.frequency_Hz for a, _ in pairs] == [b.frequency_Hz for _, b in pairs]
    assert all(a.damping_ratio is None for a, _ in pairs) and "damping" not in before.csv()
    assert all(0.005 < (b.damping_ratio or 0) < 0.1 for _, b in pairs)
    assert "damping %" in [column.name for column in after.tables()[0].columns]
    assert after.quantities()["damping_ratio [0,0] torsional"] == pytest.approx(0.0385, rel=0.03)
    assert tyre_sha256(plain) != tyre_sha256(lossy)


@pytest.mark.parametrize(
    "values",
    [
        {},
        pytest.param({"analysis.vibration_frequency_Hz": 80.0}, marks=pytest.mark.slow),
        pytest.param({"materials.rubber.frequency_exponent": 0.1}, marks=pytest.mark.slow),
    ],
)
def test_a_table_of_one_value_is_the_constant(tmp_path: Path, values: dict[str, float]) -> None:
    """Modulus by the Prony series, or of each mode's frequency, and losses go together."""
    pairs = zip(
        result(with_loss(tmp_path, "0.2", **values)).modes,
        result(with_loss(tmp_path, "[[20, 0.2], [200, 0.2]]", **values)).modes,
        strict=True,
    )
    for constant, table in pairs:
        assert table.frequency_Hz == pytest.approx(constant.frequency_Hz, rel=1e-9)
        assert table.damping_ratio == pytest.approx(constant.damping_ratio, rel=1e-6)


def test_no_frequency_depends_on_a_loss_factor(tmp_path: Path) -> None:
    case = with_loss(tmp_path, "0.2")
    path = "materials.rubber.loss_factor"
    design = TyreDesign(with_values(case, {path: 0.3}), {path: 0.3})
    answer = Evaluator(design).evaluate(Question({path: 0.3}, gradients=(path,)))
    assert not answer.gradients[path].any()
    plain = Evaluator(TyreDesign(case)).evaluate(Question({}))
    for one, other in zip(plain.modes, answer.modes, strict=True):
        assert other.damping_ratio == pytest.approx(1.5 * (one.damping_ratio or 0), rel=1e-9)


@pytest.mark.parametrize(
    ("loss", "words"),
    [
        ("20", "usual is 0 to 1 of rubber; did you mean 20 %, 0.2"),
        ("-0.1", "loss_factor is -0.1: must be at least 0"),
        ("high", "loss_factor is high: must be a number"),
        ("[[10, 0.1]]", "must have at least 2 entries"),
        ("[[10, 0.1], [20]]", r"loss_factor.1 is a list: must have at least 2 entries"),
        ("[[20, 0.1], [10, 0.1]]", "frequencies rising"),
        ("[[20, 0.1], [40, x]]", r"loss_factor.1.1 is x: must be a number"),
        ("[[20, 0.1], [40, 20]]", r"loss_factor.1.1 is 20: usual is 0 to 1"),
    ],
)
def test_loss_factors_that_are_wrong(tmp_path: Path, loss: str, words: str) -> None:
    with pytest.raises(CaseError, match=words):
        with_loss(tmp_path, loss)


def test_a_table_beside_a_bulk_modulus_that_relaxes(tmp_path: Path) -> None:
    with_loss(tmp_path, "[[20, 0.1], [40, 0.1]]")
    path = tmp_path / CASE_FILE.name
    path.write_text(path.read_text().replace("k: 0.0", "k: 0.1"))
    with pytest.raises(CaseError, match="must be one number where a term of prony has a k above 0"):
        tyrecal.load_case(path)


def test_one_loss_factor_of_a_real_tyre() -> None:
    """205/60R15, fitted: one loss factor meets the damping of both published sets, of [1,0] and
    about the axle, within 30 %."""
    case = tyrecal.load_case(CASE_FILE.with_name("205_60r15.yaml"), mesh="coarse")
    rubber = case.case.materials["rubber"].model_copy(update={"loss_factor": 0.16})
    materials = {**case.case.materials, "rubber": rubber}
    case = replace(case, case=case.case.model_copy(update={"materials": materials}))
    fitted = {"A_belt": 1.376e-7, "A_carcass": 7.998e-7, "C10": 1.755e6}
    computed = modes.run(case, Evaluator(TyreDesign(case)), fitted)[0]
    ratios = {str(mode.label): mode.damping_ratio for mode in computed.modes}
    for vertical, torsional in ((0.056, 0.050), (0.049, 0.052)):
        assert ratios["[1,0]"] == pytest.approx(vertical, rel=0.3)
        assert ratios["[0,0] torsional"] == pytest.approx(torsional, rel=0.3)


def test_a_solver_without_damping_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a loss factor would do nothing without a word."""
    own = modes.run

    def without_damping(*arguments: object) -> tuple:
        answered = own(*arguments)  # type: ignore[arg-type]
        bare = [m.model_copy(update={"damping_ratio": None}) for m in answered[0].modes]
        return answered[0].model_copy(update={"modes": bare}), *answered[1:]

    monkeypatch.setattr(modes, "run", without_damping)
    with_loss(tmp_path, "0.1")
    words = ["modes", str(tmp_path / CASE_FILE.name), "--mesh", "coarse"]
    with pytest.raises(SystemExit) as leave:
        main([*words, "--output", str(tmp_path / "out")])
    assert not leave.value.code
    assert "solver 'bundled' computes no damping" in capsys.readouterr().err
