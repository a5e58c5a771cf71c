"""Loaded modes end to end on a coarse tyre, and what a sweep over the load says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign, fine_enough
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.pressed import Footprint
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.label import Label
from tyrecal.simulate.modes.loaded import SYMMETRIES, Member
from tyrecal.studies.loaded import Loaded, LoadedMode, LoadedTyre, _grip_mm, load_tyres
from tyrecal.studies.loaded_result import findings, load_sweep_result, loaded_modes_result
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..evaluate.stand_in import CASE, StandIn
from ..evaluate.test_foreign_records import of_footprints
from .hertz import coarser_case

LOADS = [0.0, 500.0, 1000.0]
LOSS = 0.3


@pytest.fixture(scope="module")
def tyre(tmp_path_factory: pytest.TempPathFactory) -> LoadedTyre:
    """A coarse tyre whose rubber has losses, at three loads."""
    folder = tmp_path_factory.mktemp("coarse")
    case = with_values(load_case(coarser_case(folder)), {"materials.rubber.loss_factor": LOSS})
    outcome = load_tyres(
        case, Evaluator(TyreDesign(case), store=Store(folder / "record")), {"initial": {}}, LOADS
    )
    assert isinstance(outcome["initial"], LoadedTyre)
    return outcome["initial"]


def hertz(each: Loaded) -> dict[Member, float]:
    return {mode.member: mode.frequency_Hz for mode in each.modes}


@pytest.mark.slow
def test_every_family_at_every_load(tyre: LoadedTyre) -> None:
    """The list has both [0,0] once and both members of every doublet, by rising frequency, and
    no load out of place."""
    assert [each.load_N for each in tyre.loads] == LOADS and tyre.failed is None
    doublets = [Label(1, 1), Label(1, 0), Label(2, 1), Label(2, 0)]
    wanted = {Member(label, symmetry) for label in doublets for symmetry in SYMMETRIES}
    wanted |= {
        Member(Label(0, 0, "axial"), "symmetric"),
        Member(Label(0, 0, "torsional"), "antisymmetric"),
    }
    for each in tyre.loads:
        assert set(hertz(each)) == wanted and not each.unnamed
        frequencies = [mode.frequency_Hz for mode in each.modes]
        assert frequencies == sorted(frequencies)
        assert all(0 <= mode.overlap <= 1 + 1e-9 for mode in each.modes)


@pytest.mark.slow
def test_the_light_load_is_nearer_to_none(tyre: LoadedTyre) -> None:
    """Frequencies rise from those of the unloaded tyre, doublets split more and more."""
    none, light, heavy = (hertz(each) for each in tyre.loads)
    for member in none:
        assert none[member] < light[member] * 1.003 and light[member] < heavy[member] * 1.005
    first, then = (
        sum(
            abs(table[Member(Label(c, 1), s)] - none[Member(Label(c, 1), s)])
            for c in (1, 2)
            for s in SYMMETRIES
        )
        for table in (light, heavy)
    )
    assert first < then


@pytest.mark.slow
def test_members_share_the_unloaded_frequency(tyre: LoadedTyre) -> None:
    none = hertz(tyre.loads[0])
    for label in {member.label for member in none if member.label.c}:
        assert len({none[Member(label, symmetry)] for symmetry in SYMMETRIES}) == 1


@pytest.mark.slow
def test_results_as_files_hold_them(tyre: LoadedTyre) -> None:
    one = loaded_modes_result({"A": 1.0}, tyre).content()
    assert (one["load_N"], one["variables"]) == (1000.0, {"A": 1.0}) and one["mass_kg"] > 10
    for mode in one["modes"]:
        assert mode["multiplicity"] == 1 and mode["symmetry"] in SYMMETRIES
    sweep = load_sweep_result({"initial": {}}, LOADS, {"initial": tyre}).content()
    assert [row["load_N"] for row in sweep["rows"]] == LOADS and not sweep["failed"]
    assert sweep["rows"][0]["deflection_m"] == 0 < sweep["rows"][1]["deflection_m"]
    assert sweep["rows"][-1]["modes"] == one["modes"]


@pytest.mark.slow
def test_damping_is_at_most_half_the_loss_factor_and_stays_where_the_patch_is_a_node(
    tyre: LoadedTyre,
) -> None:
    none, light, heavy = (
        {mode.member: mode.damping_ratio or 0.0 for mode in each.modes} for each in tyre.loads
    )
    assert all(0 < ratio < LOSS / 2 for table in (none, light, heavy) for ratio in table.values())
    before, after = hertz(tyre.loads[0]), hertz(tyre.loads[1])
    still = [member for member in none if abs(after[member] / before[member] - 1) < 0.01]
    assert still == [Member(Label(c, 1), "antisymmetric") for c in (1, 2)]
    for member in still:
        assert light[member] == pytest.approx(none[member], rel=0.03)


def loaded(load_N: float, symmetric: float, antisymmetric: float, overlap: float = 0.9) -> Loaded:
    modes = (
        LoadedMode(Member(Label(2, 0), s), hertz, overlap, 0.95)
        for s, hertz in zip(SYMMETRIES, (symmetric, antisymmetric), strict=True)
    )
    return Loaded(load_N, load_N / 2e5, tuple(modes))


def test_findings_in_words() -> None:
    """Splits and frequencies that grow, that do not and that fall, and modes that could not be
    named."""
    loads = [
        loaded(0.0, 80.0, 80.0, 1.0),
        loaded(500.0, 82.0, 84.0),
        loaded(900.0, 85.0, 92.0, 0.3),
    ]
    content = findings("initial", loads).model_dump()
    assert [x["split"] for x in content["splits"][0]["split_Hz"]] == pytest.approx([0, 2, 7])
    assert content["words"][0] == (
        "every doublet's split grows with the load; antisymmetric less symmetric at the last, Hz:"
        " [2,0] +7.0"
    )
    assert content["words"][1] == "every frequency rises with the load"
    assert "0.30, [2,0] symmetric at 900 N (the load changes shapes" in content["words"][2]
    assert content["least_overlap"] == 0.3
    back = findings("initial", [*loads, loaded(2000.0, 90.0, 91.0)]).words
    assert "except [2,0] (900 N) from the given load on" in back[0]
    assert back[1] == "every frequency rises with the load, except [2,0] antisymmetric"
    lost = Loaded(900.0, 0.01, (), (Member(Label(3, 0), "symmetric"),), ())
    assert (
        "at 900 N no shape could be identified as [3,0] symmetric"
        in findings("initial", [lost]).words[-1]
    )


@pytest.mark.slow
def test_failures_keep_what_was_computed(tyre: LoadedTyre) -> None:
    failed = EvaluationFailed("no_equilibrium", "too much")
    cut = LoadedTyre(tyre.pressure_kPa, tyre.mass_kg, tyre.loads[:2], failed)
    result = load_sweep_result({"initial": {}}, LOADS, {"initial": cut}).content()
    assert [row["load_N"] for row in result["rows"]] == LOADS[:2]
    assert [(each["load_N"], each["words"]) for each in result["failed"]] == [(1000.0, "too much")]


def test_what_friction_can_bear() -> None:
    """The crown's largest motion times friction and load over the forces in the shape."""
    shape = np.zeros((2, 3, 2, 3))
    shape[0, 1, 1] = 0.3, 0.0, 0.4
    shape[1, 2, 0, 1] = 2.0
    footprint = of_footprints()["footprints"][0] | {
        "load_N": 600.0,
        "mode_shape": shape,
        "mode_traction_N": np.array([3e4, 6e5]),
    }
    assert _grip_mm(Footprint(**footprint), 0.5) == pytest.approx([5.0, 1.0])
    assert _grip_mm(Footprint(**footprint | {"mode_traction_N": None}), 0.0) is None


def test_the_most_that_friction_does_is_said() -> None:
    modes = [
        replace(mode, sliding_Hz=hertz, grip_mm=0.25)
        for mode, hertz in zip(loaded(900.0, 85.0, 92.0).modes, (84.0, 81.0), strict=True)
    ]
    words = findings("initial", [Loaded(900.0, 0.01, tuple(modes))]).words
    assert any("[2,0] antisymmetric at 900 N has 81.00 Hz, 11.00 Hz less" in x for x in words)
    assert any("up to a crown amplitude of 0.25 mm" in x for x in words)
    entry = loaded_modes_result({}, LoadedTyre(240.0, 12.0, (Loaded(900.0, 0.01, tuple(modes)),)))
    first = entry.content()["modes"][0]
    assert (first["sliding_Hz"], first["grip_mm"]) == (84.0, 0.25)
    bare = loaded_modes_result({}, LoadedTyre(240.0, 12.0, (loaded(900.0, 85.0, 92.0),)))
    assert "sliding_Hz" not in bare.content()["modes"][0]


def test_a_solver_without_modes_on_the_road_is_refused() -> None:
    with pytest.raises(DeckRefused, match=r"cannot find modes of a tyre on a road.*loaded_modes"):
        load_tyres(CASE, Evaluator(TyreDesign(CASE), _solver=StandIn()), {"initial": {}}, [1000.0])


@pytest.mark.slow
def test_an_unloaded_tyre_that_fails_is_the_outcome(tmp_path: Path) -> None:
    """Far too much pressure: no modes without a load either."""
    case = load_case(coarser_case(tmp_path))
    outcome = load_tyres(
        case, Evaluator(TyreDesign(case)), {"initial": {"pressure_kPa": 1900.0}}, [1000.0]
    )["initial"]
    assert isinstance(outcome, EvaluationFailed) and outcome.cause == "no_equilibrium"


@pytest.mark.parametrize("waves", [1, 2, 4, 8])
def test_elements_are_short_enough_for_the_waves(waves: int) -> None:
    """Elements near the patch stay; the rest are equally long, as short as needed, and end at
    the top."""
    angles = [4.0, 4.0, 4.0, 5.0, 7.0, 12.0, 21.0, 40.0, 83.0]
    half = fine_enough(angles, waves)
    longest = 360 / (7.5 * waves)
    assert sum(half) == pytest.approx(180) and max(half) <= longest * (1 + 1e-9)
    kept = [angle for angle in angles if angle <= longest]
    assert half[: len(kept)] == kept
    assert len(set(half[len(kept) :])) <= 1


def test_elements_that_are_short_enough_all_round_stay() -> None:
    for angles in ([10.0] * 18, [2.0] * 45 + [9.0] * 10):
        assert fine_enough(angles, 4) == angles


def test_the_deck_asks_for_modes_after_each_load() -> None:
    plain = Decks(TyreDesign(CASE), loads_N=(500.0, 900.0)).texts("abaqus")["press.inp"]
    deck = Decks(TyreDesign(CASE), loads_N=(500.0, 900.0), loaded_modes=24).texts("abaqus")[
        "press.inp"
    ]
    assert "FREQUENCY" not in plain
    assert deck.count("*STEP, NAME=MODES_") == 2 == deck.count("NORMALIZATION=MASS\n24\n")
    steps = [line.split("NAME=")[1].split(",")[0] for line in deck.splitlines() if "*STEP" in line]
    assert steps == ["EQUILIBRIUM", "LOAD_1", "MODES_1", "LOAD_2", "MODES_2"]


def test_the_cavitys_first_mode_stands_with_the_tyres() -> None:
    """Files, tables and sentences have the mode, and none of them without a gas."""
    plain = [loaded(0.0, 80.0, 80.0, 1.0), loaded(500.0, 82.0, 84.0)]
    waves = (186.0, 186.0), (185.1, 187.0)
    filled = [replace(each, cavity_Hz=hertz) for each, hertz in zip(plain, waves, strict=True)]
    for loads, count in ((plain, 0), (filled, 2)):
        tyre = LoadedTyre(240.0, 12.0, tuple(loads))
        sweep = load_sweep_result({"a": {}}, [0.0, 500.0], {"a": tyre})
        one = loaded_modes_result({}, tyre)
        assert [len(row.get("cavity", [])) for row in sweep.content()["rows"]] == [count, count]
        assert len(one.content().get("cavity", [])) == count
        cells = [row for row in sweep.tables()[0].rows if row[0] == "cavity"]
        assert (
            cells
            == [
                ["cavity", "fore-aft", "", "186.00", "185.10"],
                ["cavity", "vertical", "", "186.00", "187.00"],
            ][:count]
        )
        single = [row[:3] for row in one.tables()[0].rows if row[0] == "cavity"]
        assert (
            single == [["cavity", "fore-aft", "185.10"], ["cavity", "vertical", "187.00"]][:count]
        )
        assert len({len(row) for row in one.tables()[0].rows}) == 1
        lines = [line for line in sweep.csv().splitlines() if "cavity" in line]
        assert len(lines) == 2 * count
        if lines:
            assert lines[-1].startswith("a,500.0,0.0025,1,,cavity vertical,,187.0")
        sentences = [w for w in (*sweep.sentences(), *one.sentences()) if "cavity" in w]
        assert len(sentences) == count
        assert all("fore-aft 185.1, vertical 187.0 Hz, split +1.9" in each for each in sentences)


def test_a_mode_with_little_of_its_unloaded_shape_has_no_name() -> None:
    """The row of such a mode names its curve; a sweep, whose rows are curves, brackets its
    frequency."""
    loads = (
        loaded(0.0, 80.0, 80.0, 1.0),
        loaded(500.0, 81.0, 82.0, 0.15),
        loaded(900.0, 83.0, 85.0, 0.149),
    )
    one = loaded_modes_result({}, LoadedTyre(240.0, 12.0, loads))
    assert [row[:3] for row in one.tables()[0].rows] == [
        ["not named", "was [2,0]", "83.00"],
        ["not named", "was [2,0]", "85.00"],
    ]
    assert (
        "at 900 N less than 0.15 of the unloaded shape is left of [2,0]" in one.findings.words[-1]
    )
    sweep = load_sweep_result({"a": {}}, [0.0, 500.0, 900.0], {"a": LoadedTyre(1.0, 1.0, loads)})
    (table,) = sweep.tables()
    assert [row[3:] for row in table.rows] == [
        ["80.00", "81.00", "(83.00)"],
        ["80.00", "82.00", "(85.00)"],
    ]
    named = loaded_modes_result({}, LoadedTyre(240.0, 12.0, loads[:2]))
    assert named.tables()[0].rows[0][0] == "[2,0]" and not named.findings.words
