"""Size codes: the design dimensions of the standards' own tables, and what is no size."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tyrecal.errors import InputError
from tyrecal.tyre.section.size import ASPECTS, RIM_CODES, parse_size
from tyrecal.units import INCH

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
