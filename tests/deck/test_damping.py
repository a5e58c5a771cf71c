"""Loss factors of compounds: what the decks say of them, and the damping ratios of modes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.language.text import read_keywords

import tyrecal
from tyrecal.cli.main import main
from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.studies import modes
from tyrecal.tyre.case import CaseError, LoadedCase, start_values
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.values import with_values

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
