"""Effects that are numbers of the case: equal cases written by hand, masses, and what must rise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import Label
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.parts import Cord, Gauge, RebarLayer
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.effects.bead_seat import LEAST
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.section.section import fill_lines
from tyrecal.tyre.values import with_values

from .support import CASE, CASES, START, data, decks, frequencies

Array = np.ndarray
PLY = CASE.section.names.index("ply")
RIM = int(np.flatnonzero(CASE.section.rigid)[0])
EDGE = int(np.flatnonzero(~np.isnan(CASE.section.points[-2, :, 0]))[-1])
FINE = load_case(CASES / "p235_75r17.yaml")
AREAS = {
    name: layer.area_m2 / layer.spacing_m * CASE.case.materials[layer.material].density_kg_per_m3
    for name, layer in CASE.case.rebar_layers.items()
}  # kg/m2


def edited(**parts: object) -> dict[str, str]:
    """Decks of the case with parts of it replaced by hand."""
    case = CASE.case.model_copy(update=parts)
    return data(Decks(TyreDesign(replace(CASE, case=case))))


def set_to(**values: float) -> dict[str, str]:
    """Decks of the case with numbers set by path, __ for a dot."""
    paths = {name.replace("__", "."): value for name, value in values.items()}
    return data(Decks(TyreDesign(with_values(CASE, paths))))


def mass(**effects: float) -> float:
    values = {f"effects.{id}": value for id, value in effects.items()}
    return Evaluator(TyreDesign(CASE)).evaluate(Question({**START, **values})).mass_kg


def section(**effects: float) -> Array:
    """Points (line, station, 2) of the section with effects."""
    values = {f"effects.{id}": value for id, value in effects.items()}
    return resolved(with_values(CASE, values)).written.section.points


def length(line: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])


def swept(line: Array, weight: Array | float = 1.0) -> float:
    """Integral of ``weight`` over both halves of the surface that a line sweeps, m2."""
    return float(trapezoid(2 * 2 * np.pi * line[:, 0] * weight, length(line)))


# the same deck as a case written by hand


def test_cap_ply_is_a_layer() -> None:
    cord = Cord(kind="cord", youngs_modulus_Pa=3.5e9, poissons_ratio=0.3, density_kg_per_m3=1140.0)
    layer = RebarLayer(
        line="belt2",
        material="cap_ply_cord",
        area_m2=1e6 * 1e-3 / 3.5e9,
        spacing_m=1e-3,
        angle_deg=90.0,
    )
    materials = {**CASE.case.materials, "cap_ply_cord": cord}
    layers = {**CASE.case.rebar_layers, "cap_ply": layer}
    assert decks(CASE, cap_ply=1e6) == edited(materials=materials, rebar_layers=layers)


@pytest.mark.parametrize(
    ("id", "value", "regions", "between", "factor"),
    [
        ("sidewall_gauge", 0.1, ["upper_sidewall", "lower_sidewall"], ["inner", "outer"], 1.1),
        ("tread_wear", 0.25, ["crown"], ["belt2", "outer"], 0.75),
    ],
)
def test_gauges_are_the_cases_own(
    id: str, value: float, regions: list[str], between: list[str], factor: float
) -> None:
    gauge = Gauge(between=between, regions=regions, factor=factor)
    source = CASE.case.section.model_copy(update={"gauges": [gauge]})
    assert decks(CASE, **{id: value}) == edited(section=source)


def test_pressures_temperatures_and_angles_are_numbers_of_the_case() -> None:
    assert decks(CASE, pressure_offset=-7.0) == set_to(pressure_kPa=153.0)
    assert decks(CASE, temperature=20.0) == set_to(materials__rubber__C10_Pa=0.85e6)
    angles = {"rebar_layers__belt_1__angle_deg": 68.0, "rebar_layers__belt_2__angle_deg": 112.0}
    assert decks(CASE, belt_angle=2.0) == set_to(**angles)


def test_drift_is_a_temperature_that_follows_the_pressure() -> None:
    assert decks(CASE, temperature_drift=5.0) == decks(CASE, temperature=5.0 * -0.8)
    nominal = with_values(CASE, {"pressure_kPa": 240.0})
    assert decks(nominal, temperature_drift=5.0) == decks(nominal)


def test_fanned_carcass_is_an_angular_layer() -> None:
    bead = CASE.section.points[PLY, RIM, 0]
    layer = CASE.case.rebar_layers["carcass"].model_copy(
        update={
            "geometry": "angular",
            "spacing_m": None,
            "spacing_deg": float(np.degrees(1e-3 / bead)),
        }
    )
    layers = {**CASE.case.rebar_layers, "carcass": layer}
    assert decks(CASE, carcass_fanning=1.0) == edited(rebar_layers=layers)


# masses, from the station table


@pytest.mark.slow
def test_masses() -> None:
    ply, plain = CASE.section.points[PLY], mass()
    share = ply[RIM, 0] / ply[:, 0] - 1
    fanned = AREAS["carcass"] * swept(ply, share)
    assert mass(carcass_fanning=0.6) - plain == pytest.approx(0.6 * fanned, rel=0.01)
    low = fill_lines(CASE.section)[-2, 128:]
    assert mass(carcass_turn_up=0.5) - plain == pytest.approx(
        0.5 * AREAS["carcass"] * swept(low), rel=0.01
    )
    at = CASE.section.points[1:-1, EDGE, 0].mean()
    belts = AREAS["belt_1"] + AREAS["belt_2"]
    wider = [
        Evaluator(TyreDesign(FINE)).evaluate(Question({"effects.belt_width": b})).mass_kg
        for b in (0, 0.004)
    ]
    assert wider[1] - wider[0] == pytest.approx(0.004 * 2 * np.pi * at * belts, rel=0.05)
    hoop = 1140 * 1e6 / 3.5e9
    belt = swept(CASE.section.points[-2, : EDGE + 1])
    assert mass(cap_ply=1e6) - plain == pytest.approx(hoop * belt, rel=0.01)
    lighter = plain - mass(tread_density=-0.2)
    assert lighter == pytest.approx(2 * (plain - mass(tread_density=-0.1)))
    gauge = np.hypot(*(CASE.section.points[-1] - CASE.section.points[-2])[: EDGE + 1].T)
    middle = (CASE.section.points[-1] + CASE.section.points[-2])[: EDGE + 1] / 2
    assert lighter == pytest.approx(0.2 * 1100 * swept(middle, gauge), rel=0.02)


# geometry


def test_wider_belt_leaves_the_shape_as_it_is() -> None:
    before, after = CASE.section.points, section(belt_width=0.008)
    for line in (0, PLY, -1):
        at = length(before[line])
        curve = CubicSpline(at, before[line])(np.linspace(0, at[-1], 200_001))
        gaps = cKDTree(curve).query(after[line])[0]
        assert max(gaps) < 1e-5  # m; at the shoulder's corner, which a spline rounds
    moved = length(after[PLY])[EDGE] - length(before[PLY])[EDGE]
    assert moved == pytest.approx(0.004, rel=1e-3)
    assert after[:, -60:] == pytest.approx(before[:, -60:], nan_ok=True)


def test_wider_rim_bends_the_carcass_and_does_not_stretch_it() -> None:
    before, after = CASE.section.points, section(rim_width=0.01)
    whole = [0, PLY, -1]
    assert after[whole, RIM:] == pytest.approx(before[whole, RIM:] + [0.0, 0.005], abs=1e-9)
    assert (after[:, : EDGE + 1] == before[:, : EDGE + 1]).all()
    assert np.diff(length(after[PLY])) == pytest.approx(np.diff(length(before[PLY])), rel=1e-9)
    thickness = [np.hypot(*(points[-1] - points[0]).T) for points in (before, after)]
    assert thickness[1] == pytest.approx(thickness[0], rel=1e-9)


def test_a_bead_that_does_not_sit_is_one_whose_table_says_so() -> None:
    """A bead whose first stations are free has the same elements, materials and cords. Stations
    are so near that chords are as long as the arc."""
    table, bead = CASE.section, len(CASE.section.rigid) - 1 - RIM
    free = bead // 2
    rigid = table.rigid.copy()
    rigid[RIM : RIM + free] = False
    regions = (*table.regions[:-1], ("bead_gap", free), ("bead", bead - free))
    level = CASE.case.mesh.levels["default"]
    levels = {"default": level.model_copy(update={"elements": {**level.elements, "bead_gap": 1}})}
    mesh = CASE.case.mesh.model_copy(update={"levels": levels})
    by_hand = replace(
        CASE,
        case=CASE.case.model_copy(update={"mesh": mesh}),
        drawn=replace(table, regions=regions, rigid=rigid),
    )
    lengths = length(table.points[PLY])[RIM:] - length(table.points[PLY])[RIM]
    share = (float(lengths[free] / lengths[-1]) - LEAST) / (1 - LEAST)
    computed, expected = frequencies(bead_seat=share), frequencies(by_hand)
    assert list(computed.values()) == pytest.approx(list(expected.values()), rel=1e-6)


@pytest.mark.slow
def test_a_bead_that_nearly_sits_is_one_that_does_and_weighs_the_same() -> None:
    """The mesh differs at a fiftieth of the bead only, whose edge is finer. The smallest value
    that the deck's digits show acts like twice that value."""
    plain, least, twice = (frequencies(bead_seat=e) for e in (0.0, 1e-9, 2e-9))
    assert list(twice.values()) == pytest.approx(list(least.values()), rel=1e-8)
    assert list(least.values()) == pytest.approx(list(plain.values()), rel=0.01)
    assert mass(bead_seat=0.5) == pytest.approx(mass(), rel=1e-4)


def test_what_the_rim_lets_go_may_have_cords_rubbers_and_gauges_of_its_own() -> None:
    case = with_values(CASE, {"effects.bead_seat": 0.5})
    parts = CASE.case
    layer = parts.rebar_layers["carcass"]
    bead_only = layer.model_copy(update={"regions": ["bead"]})
    solid = parts.solids[0].model_copy(update={"regions": ["bead"]})
    gauge = Gauge(between=["inner", "ply"], regions=["bead"], factor=1.1)
    case = replace(
        case,
        case=case.case.model_copy(
            update={
                "rebar_layers": {**parts.rebar_layers, "wires": bead_only},
                "solids": [*parts.solids, solid],
                "section": parts.section.model_copy(update={"gauges": [gauge]}),
            }
        ),
    )
    written = resolved(case).written.case
    both = ["bead", "bead_gap"]
    assert written.rebar_layers["wires"].regions == both
    assert written.rebar_layers["carcass"].regions is None
    assert written.solids[-1].regions == both and written.solids[0].regions is None
    assert written.section.gauges and written.section.gauges[0].regions == both


# the vibration's modulus


def test_dynamic_stiffening_of_an_unstressed_tyre_is_a_stiffer_rubber() -> None:
    slack = with_values(CASE, {"pressure_kPa": 0.0})
    stiff = with_values(slack, {"C10": 1.5e6})
    values = {"A_belt": START["A_belt"], "A_carcass": START["A_carcass"]}
    e = Evaluator(TyreDesign(slack)).evaluate(
        Question({**values, "effects.dynamic_stiffening": 0.5})
    )
    s = Evaluator(TyreDesign(stiff)).evaluate(Question(values))
    # of omega^2 round-off leaves the same in all modes, 1e-16 of the stiffest one's: a slack tyre's
    # first, of 6 Hz, has a hundredth of the highest's
    computed, expected = ([m.frequency_Hz**2 for m in answer.modes] for answer in (e, s))
    assert computed == pytest.approx(expected, rel=2e-9, abs=2e-9 * max(expected) / 5)


@pytest.mark.parametrize("moduli", ["long_term", "instantaneous"])
def test_dynamic_stiffening_starts_from_the_cases_own_prony_series(moduli: str) -> None:
    case = with_values(CASE, {"analysis.vibration_frequency_Hz": 3.0})
    rubber = case.case.materials["rubber"].model_copy(update={"moduli": moduli})
    materials = {**case.case.materials, "rubber": rubber}
    case = replace(case, case=case.case.model_copy(update={"materials": materials}))
    plain, barely = frequencies(case), frequencies(case, dynamic_stiffening=1e-9)
    assert list(barely.values()) == pytest.approx(list(plain.values()), rel=1e-8)


# which way


RISES = {
    "dynamic_stiffening": 0.2,
    "tread_density": -0.1,
    "tread_wear": 0.1,
    "bead_filler": 0.5,
    "rim_width": 0.005,
    "pressure_offset": 5.0,
    "temperature": -5.0,
    "temperature_drift": 2.0,  # colder below the case's pressure
}


def test_every_mode_falls_where_a_bead_does_not_sit() -> None:
    plain, with_it = frequencies(), frequencies(bead_seat=0.3)
    assert all(with_it[label] < f for label, f in plain.items())


@pytest.mark.parametrize("id", RISES)
def test_every_mode_rises(id: str) -> None:
    plain, with_it = frequencies(), frequencies(**{id: RISES[id]})
    assert all(with_it[label] > f for label, f in plain.items())


@pytest.mark.parametrize(
    ("id", "value"), [("cap_ply", 1e6), ("belt_width", 0.005), ("belt_angle", -1.0)]
)
def test_belt_bends_in_its_plane_at_higher_frequency(id: str, value: float) -> None:
    plain, with_it = frequencies(), frequencies(**{id: value})
    bending = [label for label in plain if label.c > 1]
    assert len(bending) >= 5
    assert all(with_it[label] > plain[label] for label in bending)


@pytest.mark.parametrize("id", [e.id for e in catalogue().values() if not e.needs])
def test_calculix_has_a_deck_of_it(id: str) -> None:
    case: LoadedCase = with_values(CASE, {f"effects.{id}": catalogue()[id].high / 2})
    assert Decks(TyreDesign(case)).texts("calculix") != Decks(TyreDesign(CASE)).texts("calculix")


def test_turned_up_carcass_holds_the_belt_from_the_side() -> None:
    plain, with_it = frequencies(), frequencies(carcass_turn_up=0.5)
    for label in (Label(0, 0, "axial"), Label(1, 1)):
        assert with_it[label] > 1.01 * plain[label]


def test_turned_up_and_fanned_carcass_have_surface_elements_of_their_own() -> None:
    deck = decks(CASE, carcass_turn_up=0.5, carcass_fanning=0.4)["inflate.inp"]
    numbers = [
        int(line.split(",")[0])
        for block in deck.split("*ELEMENT, TYPE=")[1:]
        for line in block.split("*")[0].splitlines()[1:]
    ]
    assert len(set(numbers)) == len(numbers)
    sections = [line for line in deck.splitlines() if line.startswith("*SURFACE SECTION")]
    sets = [line.split("ELSET=")[1] for line in sections]
    assert sorted(sets) == ["BELT1", "BELT2", "BELT2_2", "BELT2_3", "PLY", "PLY_2"]
    assert all(deck.count(f"ELSET={name}\n") == 2 for name in sets)  # its elements, its section


def test_layer_ends_with_its_regions() -> None:
    layer = CASE.case.rebar_layers["carcass"]
    short = layer.model_copy(update={"regions": ["crown", "upper_sidewall"]})
    layers = {**CASE.case.rebar_layers, "carcass": short}
    long = data(Decks(TyreDesign(CASE)))["inflate.inp"]
    deck = edited(rebar_layers=layers)["inflate.inp"]
    gone = set(long.splitlines()) - set(deck.splitlines())
    assert len(gone) == 2 * (3 + 1)  # the lower sidewall's and the bead's elements, both sides
    assert set(deck.splitlines()) < set(long.splitlines())


@pytest.mark.parametrize(("id", "value"), [("tread_wear", 0.4), ("tread_density", -0.2)])
def test_what_else_there_is_to_an_effect_is_no_more_of_it(id: str, value: float) -> None:
    """Wear that is uneven, voids that take stiffness: the same mass, of which 0.4 of the tread is
    17 %; wear is even in its mean across, and the tread a little thicker at its edges."""
    effect = catalogue()[id]
    assert effect.shape_uncertainty
    plain, other = (
        Evaluator(TyreDesign(made)).evaluate(Question({})).mass_kg
        for made in (effect.add(CASE, value), effect.shape_uncertainty(CASE, value))
    )
    assert other == pytest.approx(plain, rel=5e-3)


def test_a_higher_filler_stiffens_the_region_above_by_its_share() -> None:
    """The filler is 10 mm higher than its region; a section with no region above reports that."""
    higher = catalogue()["bead_filler"].shape_uncertainty
    assert higher
    made = higher(CASE, 2.0)
    added = [solid for solid in made.case.solids if solid.regions == ["upper_sidewall"]]
    own, (above,) = CASE.case.materials["rubber"].C10_Pa, added
    first = CASE.section.points[PLY]
    regions = dict(CASE.section.regions)
    begin = regions["crown"]
    upper = length(first[begin : begin + regions["upper_sidewall"] + 1])[-1]
    share = 0.010 / upper
    assert made.case.materials[above.material].C10_Pa == pytest.approx(own * (1 + 2 * share))


def test_a_cap_ply_may_reach_the_edge_of_the_widest_belt() -> None:
    """The ply is as much heavier as the area of the widest belt is larger; belts that end
    together give no change."""
    effect = catalogue()["cap_ply"]
    assert effect.shape_uncertainty
    with pytest.raises(ValueError, match="no belt is wider than the outer one"):
        effect.shape_uncertainty(CASE, 1e6)
    stepped = load_case(CASES / "205_60r15.yaml")
    plain, own, wider = (
        Evaluator(TyreDesign(made)).evaluate(Question({})).mass_kg
        for made in (stepped, effect.add(stepped, 1e6), effect.shape_uncertainty(stepped, 1e6))
    )
    area = {}
    for name in ("belt1", "belt2"):
        line = stepped.section.points[stepped.section.names.index(name)]
        r, z = line[~np.isnan(line[:, 0])].T
        area[name] = np.hypot(np.diff(r), np.diff(z)) @ (r[1:] + r[:-1])
    assert (wider - plain) / (own - plain) == pytest.approx(area["belt1"] / area["belt2"], rel=1e-3)
