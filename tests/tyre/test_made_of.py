"""Parts of a section from a size code, and the changes that effects make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.abaqus import claimed, solid_claims
from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.new_case import from_file, from_size
from tyrecal.tyre.case.parts import Cord
from tyrecal.tyre.effects import EffectRefused
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import Tyre, resolved
from tyrecal.tyre.section.construction import LIGHT_TRUCK, PASSENGER, TRUCK, Compound
from tyrecal.tyre.section.size import parse_size
from tyrecal.tyre.values import set_values

from ..conftest import CASES

CODES = {"205/55R16": PASSENGER, "LT245/75R16": LIGHT_TRUCK, "315/80R22.5": TRUCK}


@pytest.fixture(scope="module", params=CODES)
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> LoadedCase:
    folder = tmp_path_factory.mktemp("size")
    draft = from_size(parse_size(request.param), {}, None, "tyre")
    (folder / draft.file).write_bytes(draft.content)
    (folder / "tyre.yaml").write_text(draft.text.replace("level: default", "level: coarse"))
    return load_case(folder / "tyre.yaml")


def with_effect(case: LoadedCase, id: str, value: float) -> Tyre:
    return resolved(set_values(case, {f"effects.{id}": value}))


@pytest.mark.parametrize(("hardness", "E_MPa"), [(50, 2.47), (65, 4.45), (80, 9.39)])
def test_rubber_by_its_hardness(hardness: float, E_MPa: float) -> None:
    """Gent's relation, worked out by hand; nu = 0.475 of G = 2 C10 and K = 2 / D1."""
    compound = Compound(hardness, 1100.0)
    G, K = 2 * compound.C10_Pa, 2 / compound.D1_per_Pa
    assert pytest.approx(E_MPa, rel=2e-3) == 3e-6 * G
    assert pytest.approx(0.475) == (3 * K - 2 * G) / (6 * K + 2 * G)
    assert 10 < compound.spread_percent < 30  # 4 Shore A


def test_every_element_is_of_one_compound_and_each_is_used(case: LoadedCase) -> None:
    rows = tuple(case.case.mesh.levels["coarse"].rows)
    claims, mesh, lines = solid_claims(case.case), resolved(case).mesh, case.section.names
    used = set()
    for region, row in mesh.cells.values():
        owners = [
            i for i, each in enumerate(claims) if claimed((each,), lines, rows, region, row) == 0
        ]
        assert len(owners) == 1
        used.add(case.case.solids[owners[0]].material)
    made = CODES[case.case.size]
    assert used == set(made.compounds)
    for name, compound in made.compounds.items():
        rubber = case.case.materials[name]
        assert rubber.C10_Pa == pytest.approx(compound.C10_Pa, rel=5e-3)  # type: ignore[union-attr]


def test_bead_wires_have_their_steel(case: LoadedCase) -> None:
    layer, made = case.case.rebar_layers["bead_wire"], CODES[case.case.size]
    held = case.section.points[1, case.section.rigid]
    length = np.hypot(*np.diff(held, axis=0).T).sum()
    assert layer.area_m2 / layer.spacing_m * length == pytest.approx(
        made.wires * made.wire, rel=5e-3
    )
    assert layer.regions == ["bead"] and layer.angle_deg == 90


def test_textile_and_carcass_cords_go_slack_belts_and_wires_do_not(case: LoadedCase) -> None:
    """By layer; and each material has a spread of its own."""
    cords = {n: m for n, m in case.case.materials.items() if isinstance(m, Cord)}
    for name, layer in case.case.rebar_layers.items():
        bears = cords[layer.material].bears_compression
        assert bears == name.startswith(("belt_", "bead_wire")), name
    assert {f"{name}_modulus" for name in cords} < set(case.case.uncertainties)


def test_abaqus_is_told_which_cords_bear_no_compression(case: LoadedCase) -> None:
    """`*NO COMPRESSION` in the materials of textile and carcass cords, and in no other."""
    text = Decks(TyreDesign(case)).texts("abaqus")["inflate.inp"]
    blocks = [block.split("\n", 1) for block in text.split("*MATERIAL, NAME=")[1:]]
    slack = {name.lower() for name, rest in blocks if "*NO COMPRESSION" in rest}
    truck = CODES[case.case.size] is TRUCK
    assert slack == ({"carcass_cord"} if truck else {"polyester_cord", "nylon_cord"})


def test_a_section_of_one_rubber_has_a_slack_carcass_too(tmp_path: Path) -> None:
    """And stiff belts, as a line of its case."""
    draft = from_file(CASES / "205_60r15.csv", parse_size("205/60R15"), None, None)
    (tmp_path / draft.file).write_bytes(draft.content)
    (tmp_path / "tyre.yaml").write_text(draft.text)
    cords = load_case(tmp_path / "tyre.yaml").case.materials
    bears = {n: m.bears_compression for n, m in cords.items() if isinstance(m, Cord)}
    assert bears == {"belt_cord": True, "carcass_cord": False}
    assert draft.text.count("bears_compression: false}\n") == 1


def test_wear_takes_the_tread_and_leaves_what_lies_under_it(case: LoadedCase) -> None:
    base = case.section.names.index("base")
    crown = int(case.section.regions[0][1]) // 2  # between regions a station has half of it
    new, worn = resolved(case).gauged.points, with_effect(case, "tread_wear", 0.25).gauged.points
    thickness = [np.hypot(*(points[-1] - points[base])[crown]) for points in (new, worn)]
    assert thickness[1] == pytest.approx(0.75 * thickness[0])
    assert worn[: base + 1, crown] == pytest.approx(new[: base + 1, crown])


def test_other_effects_know_filler_belts_and_turn_up(case: LoadedCase) -> None:
    stiffer = with_effect(case, "bead_filler", 1.0).case
    copies = {name for name in stiffer.materials if name not in case.case.materials}
    high = CODES[case.case.size].high  # the turn-up: sidewall rubber lies above the filler's tip
    assert copies == {"bead_filler_filler", *(["sidewall_filler"] if high else [])}
    turned = with_effect(case, "belt_angle", 1.0).case.rebar_layers
    moved = {n for n, layer in turned.items() if layer != case.case.rebar_layers[n]}
    assert moved == {name for name in turned if name.startswith("belt_")}
    denser = with_effect(case, "tread_density", 0.1).case
    assert {name for name in denser.materials if name not in case.case.materials} == {"tread_tread"}
    with pytest.raises(EffectRefused, match="turned up already"):
        with_effect(case, "carcass_turn_up", 1.0)


def test_variables_and_spreads_are_of_the_case(case: LoadedCase, tmp_path: Path) -> None:
    assert {"A_belt", "A_carcass", "C10_sidewall", "C10_tread"} == set(case.case.variables)
    spreads = case.case.uncertainties
    rubbers = {f"{name}_C10" for name in CODES[case.case.size].compounds}
    assert rubbers < set(spreads) and spreads["bead_filler_C10"].percent
    assert case.case.road.loads_N == sorted(set(case.case.road.loads_N))


def test_the_table_of_a_size_keeps_its_compounds(case: LoadedCase) -> None:
    """Given again as a section of one's own."""
    again = from_file(case.folder / "tyre.csv", parse_size(case.case.size), None, None)
    (case.folder / "again.yaml").write_text(again.text)
    other = load_case(case.folder / "again.yaml").case
    for part in ("materials", "solids", "rebar_layers", "variables"):
        assert getattr(other, part) == getattr(case.case, part)
