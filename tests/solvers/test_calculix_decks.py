"""CalculiX's decks and options: what is refused, and what ccx would get wrong without a word."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.calculix.adapter import CalculiX, Refused, _check_rubber
from tyrecal_solvers.errors import RunFailed

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case
from tyrecal.tyre.templates import TemplateFailed
from tyrecal.tyre.values import with_values

from ..conftest import CASES


def main_case(**options: object) -> LoadedCase:
    """The paper's tyre with options of the solver."""
    loaded = load_case(CASES / "p235_75r17.yaml")
    solver = loaded.case.solver.model_copy(update={"name": "calculix", "options": options})
    return LoadedCase(
        loaded.case.model_copy(update={"solver": solver}),
        loaded.path,
        loaded.section,
        loaded.folder,
        loaded.file_data,
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"comand": "ccx"}, "no 'comand'"),
        ({"command": "ccx"}, "has no 'command'"),
        ({"parallel": 0}, "must be 1 or more"),
        ({"parallel": True}, "must be 1 or more"),
    ],
)
def test_wrong_options_are_refused(tmp_path: Path, options: dict, words: str) -> None:
    with pytest.raises(Refused, match=words):
        CalculiX().write(Decks(TyreDesign(main_case(**options))), tmp_path)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"element": "C3D4"}, "must be C3D20R, C3D20 or C3D8"),
        ({"ply_thickness_m": "thin"}, "must be a thickness"),
        ({"ply_thickness_m": 2e-3}, "do not fit.*folds over"),
    ],
)
def test_decks_that_cannot_be_written(options: dict, words: str) -> None:
    with pytest.raises(TemplateFailed, match=words):
        Decks(TyreDesign(main_case(**options))).texts("calculix")


def test_a_vibration_frequency_is_refused(tmp_path: Path) -> None:
    case = with_values(main_case(), {})
    analysis = case.case.analysis.model_copy(update={"vibration_frequency_Hz": 50.0})
    case = LoadedCase(
        case.case.model_copy(update={"analysis": analysis}),
        case.path,
        case.section,
        case.folder,
        case.file_data,
    )
    with pytest.raises(TemplateFailed, match="vibration_frequency_Hz must be null"):
        Evaluator(TyreDesign(case), "calculix", folder=tmp_path).evaluate(Question({}))


@pytest.mark.parametrize(
    ("row", "stable"),
    [
        ("1e5, -0.9e5, 1e-8", True),
        ("1e5, -1e5, 1e-8", False),
        ("1e5, 1e5, 0.0", False),
        ("1e5, 1e5, -1e-8", False),
        ("-1e5, 2e5, 1e-8", True),
        ("1e5, x, 1e-8", True),  # ccx complains of it
    ],
)
def test_rubber_that_is_none_is_not_left_to_ccx(tmp_path: Path, row: str, stable: bool) -> None:
    path = tmp_path / "sector.inp"
    good = "*HYPERELASTIC, MOONEY-RIVLIN\n5e5, 1e5, 1e-8\n"
    path.write_text(f"{good}*HYPERELASTIC, MOONEY-RIVLIN\n{row}\n*DENSITY\n1100\n")
    if stable:
        _check_rubber(path)
    else:
        with pytest.raises(RunFailed, match="is unstable") as failure:
            _check_rubber(path)
        assert failure.value.cause == "unstable"


def test_decks_have_one_diameter_each_and_half_the_pressure() -> None:
    """Demands of three silent traps of ccx 2.20, and the plies' stiffness and mass."""
    texts = Decks(TyreDesign(main_case(), {}), modes_per_harmonic=3).texts("calculix")
    assert list(texts) == ["sector.inp", "inflate.inp", *(f"modes_{n}.inp" for n in range(5))]
    assert "CAVITY, P6, 240000\n" in texts["inflate.inp"]
    for n in range(5):
        deck = texts[f"modes_{n}.inp"]
        assert deck.count("*FREQUENCY\n6\n") == 1
        assert f"NMIN={n}, NMAX={n}\n" in deck
        assert "CAVITY, P6, 120000\n" in deck and "*RESTART, READ, STEP=2\n" in deck
    lines = texts["sector.inp"].splitlines()
    start = lines.index("*MATERIAL, NAME=BELT_1_8")
    values = [float(x) for x in ",".join(lines[start + 2 : start + 5]).split(",")]
    k = 172.2e9 * 2.118683e-7 / (1.16e-3 * 2e-4)
    # near the crown, 70 degrees from the meridian: theta theta theta theta is sin^4
    assert len(values) == 21
    assert values[2] == pytest.approx(k * np.sin(np.radians(70)) ** 4, rel=1e-4)
    assert values[5] == pytest.approx(k * np.cos(np.radians(70)) ** 4, rel=2e-3)
    density = float(lines[lines.index("*DENSITY", start) + 1])
    assert density == pytest.approx(5900 * 2.118683e-7 / (1.16e-3 * 2e-4), rel=2e-4)


def test_the_inflated_state_is_one_of_revolution_and_let_go() -> None:
    """Nodes halfway between the faces follow those in front, in the inflating step alone."""
    texts = Decks(TyreDesign(main_case())).texts("calculix")
    rows = re.findall(r"\*EQUATION\n3\n([^\n]*)", texts["sector.inp"])
    nodes = texts["sector.inp"].split("*NODE, NSET=TYRE\n")[1].split("*")[0].splitlines()
    place = {n: np.array([float(x) for x in xyz]) for n, *xyz in (x.split(", ") for x in nodes)}
    for row in rows:
        node, i, minus, front, one, a, other, two, b = row.split(", ")
        assert (minus, one, two, front) == ("-1.0", "1", "2", other)
        carried = float(a) * place[front][0] + float(b) * place[front][1]
        assert carried == pytest.approx(place[node][int(i) - 1], abs=1e-6)
    first, second = texts["inflate.inp"].split("*END STEP", 1)
    assert rows and "*EQUATION" not in first and "*EQUATION, REMOVE\nBETWEEN, 1, 3" in second
    plain = Decks(TyreDesign(main_case(element="C3D8"))).texts("calculix")
    assert "EQUATION" not in plain["sector.inp"] + plain["inflate.inp"]
    assert "*RESTART, READ, STEP=1\n" in plain["modes_0.inp"]


def test_the_program_says_its_version() -> None:
    solver = CalculiX()
    for words, version in (("This is Version 2.20", "2.20"), ("who knows", "unknown")):
        solver.command = [sys.executable, "-c", f"print('{words}')"]
        assert solver.version == version
    solver.command = ["no-such-ccx"]
    assert solver.version == "unknown"
