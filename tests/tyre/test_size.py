"""Size codes: dimensions of the standards' own tables, and the parts of a section made from one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tyrecal.errors import InputError
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
from tyrecal.tyre.section.size import ASPECTS, RIM_CODES, parse_size
from tyrecal.tyre.values import set_values
from tyrecal.units import INCH

from ..conftest import CASES

# overall diameter and design section width, mm, measuring rim, inch: tables of the European Tyre
# and Rim Technical Organisation and the Tire and Rim Association, which round the rim's diameter
# and the section's height to 1 mm before they add them
TABLES = {
    "145/80R13": (562, 145, 4.0),
    "175/65R14": (584, 177, 5.0),
    "195/65R15": (635, 201, 6.0),
    "205/60R15": (627, 209, 6.0),
    "205/55R16": (632, 214, 6.5),
    "225/50R17": (658, 233, 7.0),
    "225/45R17": (634, 225, 7.5),
    "245/40R18": (653, 248, 8.5),
    "255/35R19": (661, 255, 9.0),
    "P235/75R17": (784, 235, 6.5),
    "LT245/75R16": (774, 248, 7.0),
    "30x9.50R15LT": (750, 240, 7.5),
    "31x10.50R15LT": (775, 268, 8.5),
    "33x12.50R15LT": (826, 318, 10.0),
    "11R22.5": (1054, 279, 8.25),
    "295/80R22.5": (1044, 298, 9.0),
    "315/80R22.5": (1076, 312, 9.0),
    "385/65R22.5": (1072, 389, 11.75),
}


@pytest.mark.parametrize("code", TABLES)
def test_design_dimensions_are_those_of_the_tables(code: str) -> None:
    diameter, width, rim = TABLES[code]
    size = parse_size(code)
    assert 1e3 * size.overall_diameter == pytest.approx(diameter, abs=1.5)
    assert 1e3 * size.section_width(size.measuring_rim) == pytest.approx(width, abs=1.0)
    assert size.measuring_rim / INCH == pytest.approx(rim)


@given(
    st.integers(12, 39).map(lambda n: 10 * n + 5),
    st.sampled_from(ASPECTS),
    st.sampled_from(RIM_CODES),
    st.sampled_from(["", "P", "LT", "HL"]),
)
def test_any_metric_size_means_what_it_says(width: int, aspect: int, rim: int, kind: str) -> None:
    size = parse_size(f"{kind}{width}/{aspect}R{rim}")
    assert size.section_height == pytest.approx(1e-3 * width * aspect / 100)
    assert size.overall_diameter == pytest.approx(INCH * rim + 2 * size.section_height)
    half_inch = size.section_width(size.measuring_rim + INCH / 2)
    assert half_inch - size.section_width(size.measuring_rim) == pytest.approx(0.2 * INCH)
    assert size.bead_seat_radius < size.flange_radius(size.measuring_rim)
    assert abs(2 * size.bead_seat_radius - INCH * rim) < 5e-3


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("205/60r15", "205/60R15"),
        (" 205 / 60 R 15  91V ", "205/60R15"),
        ("205/60HR15", "205/60R15"),
        ("205/60ZR15 (91Y)", "205/60R15"),
        ("p235/75r17 108S M+S", "P235/75R17"),
        ("lt315/70 r17 121/118S", "LT315/70R17"),
        ("31X10.50r15 lt 109Q", "31x10.50R15LT"),
        ("31×10.50R15LT", "31x10.50R15LT"),
    ],
)
def test_ways_to_write_a_size(text: str, same: str) -> None:
    one, other = parse_size(text), parse_size(same)
    assert (one.width, one.overall_diameter, one.rim_code, one.kind, one.pressure_kPa) == (
        other.width,
        other.overall_diameter,
        other.rim_code,
        other.kind,
        other.pressure_kPa,
    )


def test_the_service_description_sets_the_pressure() -> None:
    for text, kPa in [
        ("205/60R15", 250),
        ("225/45R17 94Y XL", 290),
        ("P235/75R17", 240),
        ("LT245/75R16", 350),
        ("LT245/75R16/E", 550),
        ("LT245/75R16 120/116S LRD", 450),
        ("LT245/75R16/E 120/116S", 550),
        ("LT245/75R16E", 550),
        ("LT245/75R16C 120/116S", 350),
        ("37x12.50R17LT/D 124R", 450),
        ("225/45R17XL 94Y", 290),
        ("31x10.50R15LT C", 350),
        ("35x12.50R17LT 121R Load Range E", 550),
        ("205/65R16C", 400),
        ("HL265/35R21", 290),
        ("HL 245/40R19 101Y XL", 290),
        ("315/80R22.5 156/150L", 850),
        ("11R22.5 LRG", 720),
        ("11R22.5 144/142L", 720),
        ("11R22.5/H 146/143L", 830),
        ("215/75R17.5", 725),
    ]:
        assert parse_size(text).pressure_kPa == kPa, text


@pytest.mark.parametrize(
    ("code", "kg"),
    [("205/55R16 91V", 615), ("P235/75R17 108S", 1000), ("315/80R22.5 156/150L", 4000)],
)
def test_the_load_index_is_the_tables_within_a_per_cent(code: str, kg: float) -> None:
    assert parse_size(code).load_N == pytest.approx(9.81 * kg, rel=0.01)
    # about as much is taken where it is not stated
    assert parse_size(code.split()[0]).load_N == pytest.approx(9.81 * kg, rel=0.2)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("205/60-15", "bias-ply"),
        ("205/60D15", "bias-ply"),
        ("T125/80B15", "bias-ply"),
        ("31x10.50-15LT", "bias-ply"),
        ("225/45RF17", "run-flat.*insert"),
        ("225/45R17 91W RFT", "run-flat.*insert"),
        ("225/45X17", "no construction"),
        ("155R13", "aspect ratio is missing"),
        ("6.00-16", "diameter too"),
        ("205/62R15", "aspect ratios are"),
        ("999/60R15", "section widths are"),
        ("205/60R99", "no rim"),
        ("205/60R16.5", "no rim"),
        ("6R22.5", "widths known on a 22.5 inch rim are 8, 9, 10"),
        ("12.00R20", "truck tyre with a tube"),
        ("11-22.5", "bias-ply"),
        ("11R22.5 LRB", "load range B is not known, F, G"),
        ("33x12.50R19.5", "no rim"),
        ("180/55ZR17", "motorcycle"),
        ("120/70ZR17", "motorcycle"),
        ("120/70ZR17M/C", "motorcycle"),
        ("110/70-17 54H", "motorcycle"),
        ("90/90-21", "motorcycle"),
        ("MT90B16", "motorcycle"),
        ("3.00-18", "motorcycle"),
        ("400/60R15", "section widths are"),
        ("12x10.50R15LT", "no tyre"),
        ("60x10.50R15LT", "no tyre"),
        ("31x40R15LT", "8 to 16 inches"),
        ("205/60R15 hello", "service description"),
        ("LT245/75R16 LRH", "load range"),
        ("195/55R370", "not a tyre size"),
        ("a bicycle", "not a tyre size"),
        ("", "not a tyre size"),
    ],
)
def test_what_is_no_radial_tyre(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        parse_size(text)
    assert "\n" not in str(error.value)


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


@pytest.mark.parametrize("part", ["liner", "ply", "belt", "under_tread", "step", "wires", "filler"])
def test_a_light_truck_is_between_a_car_and_a_truck(part: str) -> None:
    car, light, truck = (getattr(made, part) for made in CODES.values())
    assert car <= light <= truck


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
