"""A section that is a little off everywhere: the fields' statistics, and their slopes against the
model with what they say changed in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.find import LabelledModes, find_modes
from tyrecal.studies.diagnose.diagnosis import diagnose
from tyrecal.studies.diagnose.posteriors import section_posterior
from tyrecal.studies.inference.inverse_problem import Assumed
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.section_fields import (
    CORRELATION_LENGTH,
    SECTION,
    SECTION_SIZES,
    arc_length,
    components,
    fields,
    filler_tip,
    moved,
    sizes,
    with_fields,
)
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import RIM_WIDTH, sources
from tyrecal.studies.modes import modes_result
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.case.new_case import from_size
from tyrecal.tyre.case.parts import Cord
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.effects.parts import belt_edge, carcass_line, rim_edge, stations
from tyrecal.tyre.load import load_case
from tyrecal.tyre.section.size import parse_size

from ..chance import Chance
from .coarse_model import CASE
from .toy import LABELS, Toy, problem

Array = np.ndarray
pytestmark = pytest.mark.numbers
STATED = changed(CASE, section=with_part(CASE.case.section, known_from="drawing"))
ROWS = [*((label, 240.0) for label in LABELS), (None, 0.0)]


def test_a_case_that_does_not_say_what_its_section_is_known_from_has_it_from_a_drawing() -> None:
    """And its words say so; an exact one has no fields."""
    assert not fields(CASE) and not any(source.field for source in sources(CASE)[0])
    silent = changed(CASE, section=with_part(CASE.case.section, known_from=None))
    stated, unsaid = (
        [source for source in sources(case)[0] if source.field] for case in (STATED, silent)
    )
    assert "drawing: meridian 0.8 mm" in stated[0].words
    assert "drawing, not stated in the case: meridian 0.8 mm" in unsaid[0].words
    assert not any(source.words for source in (*stated[1:], *unsaid[1:]))
    for a, b in zip(stated, unsaid, strict=True):
        assert a.field and b.field and a.name == b.name
        np.testing.assert_array_equal(a.field.values, b.field.values)


def test_a_tall_section_of_a_size_code_is_off_in_proportion(tmp_path: Path) -> None:
    """A truck's is 0.207 m high from the rim on: 3 and 9 mm of a car's, times 0.207 / 0.15."""
    lengths = {}
    for code in ("205/60R15", "11R22.5"):
        draft = from_size(parse_size(code), {}, None, "tyre")
        (tmp_path / draft.file).write_bytes(draft.content)
        (tmp_path / "tyre.yaml").write_text(draft.text, encoding="utf-8")
        lengths[code] = sizes(load_case(tmp_path / "tyre.yaml", allow_unusual=True))
    assert lengths["205/60R15"] == SECTION_SIZES["size_code"]
    assert lengths["11R22.5"][:2] == pytest.approx((4.13e-3, 12.4e-3), rel=0.01)
    assert lengths["11R22.5"][2:] == SECTION_SIZES["size_code"][2:]
    assert sizes(STATED) == SECTION_SIZES["drawing"]


def test_beads_are_held_as_far_apart_as_the_section_is_known_unless_the_case_states_it(
    tmp_path: Path,
) -> None:
    """As half of a rim_width by the size; by a case's own number where it has one, once."""
    draft = from_size(parse_size("205/60R15"), {}, None, "tyre")
    (tmp_path / draft.file).write_bytes(draft.content)
    (tmp_path / "tyre.yaml").write_text(draft.text, encoding="utf-8")
    case = load_case(tmp_path / "tyre.yaml")
    known = lambda origin: changed(case, section=with_part(case.case.section, known_from=origin))
    steps = lambda case: [s.steps[RIM_WIDTH] for s in sources(case)[0] if RIM_WIDTH in s.steps]
    sizes = {"exact": [], "measured": [0.5e-3], "drawing": [1e-3], "size_code": [5e-3]}
    assert {origin: steps(known(origin)) for origin in sizes} == sizes
    assert steps(known(None)) == sizes["drawing"]
    (seat,) = [s for s in sources(known("size_code"))[0] if RIM_WIDTH in s.steps]
    assert seat.words == "bead seat distance 5 mm"
    own = case.file_data["uncertainties"] | {"rim": {"sets": [RIM_WIDTH], "absolute": 2e-3}}
    assert steps(changed(case, uncertainties=own)) == [2e-3]


def test_without_a_carcass_from_bead_to_bead_only_an_exact_section_can_be_stated() -> None:
    case = changed(CASE, rebar_layers={})
    assert not fields(changed(case, section=with_part(case.case.section, known_from=None)))
    with pytest.raises(InputError, match=r"section\.known_from must be exact, got drawing"):
        fields(changed(case, section=with_part(case.case.section, known_from="drawing")))


def test_components_have_the_covariance_of_the_field() -> None:
    """1 up to a correlation length from the rim, 0 on it; between two places as the kernel says."""
    s = np.linspace(0, 1.1, 56)
    shapes = components(s)
    covariance = shapes.T @ shapes
    assert len(shapes) <= 5
    assert np.diag(covariance)[s < 0.5] == pytest.approx(1.0, abs=0.02)
    assert abs(shapes[:, s >= 1]).max() == 0
    i, j = 20, 10  # far from the crown's mirror image, and from the rim
    wanted = np.exp(-((s[i] - s[j]) ** 2) / (2 * CORRELATION_LENGTH**2))
    assert covariance[i, j] == pytest.approx(wanted, abs=0.15)


def test_a_filler_s_tip_goes_along_the_carcass_and_the_surfaces_stay(tmp_path: Path) -> None:
    """9 mm towards the crown by a standard deviation, here a tenth of it: along surfaces but for
    their turns from station to station. Neither belt nor rim moves. The shipped case, of one
    rubber, has no filler."""
    assert not any("filler" in name for name in fields(STATED))
    draft = from_size(parse_size("205/60R15"), {}, None, "made")
    (tmp_path / draft.file).write_bytes(draft.content)
    (tmp_path / "made.yaml").write_text(draft.text, encoding="utf-8")
    case = load_case(tmp_path / "made.yaml")
    (field,) = [each for name, each in fields(case).items() if "filler" in name]
    before, after = case.section, moved(case, field, 0.1).section
    tip, edge, rim = filler_tip(case), belt_edge(case), rim_edge(case.section)
    assert tip is not None
    place = before.names.index(carcass_line(case))
    arc = lambda p: np.hypot(*np.diff(p[place], axis=0).T).cumsum()
    assert arc(before.points)[tip - 1] - arc(after.points)[tip - 1] == pytest.approx(9e-4, rel=0.01)
    np.testing.assert_array_equal(after.points[:, : edge + 1], before.points[:, : edge + 1])
    np.testing.assert_array_equal(after.points[:, rim:], before.points[:, rim:])
    for line in (0, place, -1):
        old, new = before.points[line], after.points[line]
        near = np.hypot(*(new[:, None] - densely(old)).transpose(2, 0, 1)).min(1)
        angle = np.unwrap(np.arctan2(*np.diff(old, axis=0).T))
        assert near.max() < 0.9e-3 * abs(np.diff(angle))[edge:rim].max()


def densely(line: Array) -> Array:
    """A line's points with a hundred more between any two."""
    at = np.arange(len(line))
    many = np.linspace(0, at[-1], 100 * at[-1] + 1)
    return np.stack([np.interp(many, at, line[:, k]) for k in range(2)], 1)


def test_a_section_moves_by_what_is_stated() -> None:
    """Sums of squares of the components' displacements, amid the sidewall: 0.8 mm, and 4 %."""
    s = arc_length(STATED)
    place = int(np.argmin(abs(s - 0.45)))
    section, square = STATED.section, {"meridian": 0.0, "gauge": 0.0}
    thick = lambda points: np.linalg.norm(points[-1, place] - points[0, place])
    for field in fields(STATED).values():
        if field.kind in square:
            points = moved(STATED, field, 1.0).section.points
            off = np.linalg.norm(points[0, place] - section.points[0, place])
            ratio = thick(points) / thick(section.points) - 1
            assert abs(ratio) < 1e-9 or field.kind == "gauge"
            square[field.kind] += float(off if field.kind == "meridian" else ratio) ** 2
            assert np.nanmax(abs(points - section.points)[:, s > 1]) == 0
    meridian, _, gauge, *_ = SECTION_SIZES["drawing"]
    assert np.sqrt(square["meridian"]) == pytest.approx(meridian, rel=0.02)
    assert np.sqrt(square["gauge"]) == pytest.approx(gauge, rel=0.02)


@pytest.mark.slow
def test_slopes_of_fields_are_the_model_s_own() -> None:
    """Meridian and gauge: central differences, whose own error, of second order, is taken out by
    half the step (Richardson): 1e-5 of the largest. Compounds: all densities up by one per cent are
    the rubber's density."""
    own_sources = sources(STATED)[0]
    model = TyreModel(STATED, Evaluator(TyreDesign(STATED)), ROWS, own_sources, {})
    (at_0,) = model.answers([Query(model.start, constants=True)])
    assert isinstance(at_0, Answer) and at_0.constants is not None
    column = {source.name: at_0.constants[:, k] for k, source in enumerate(own_sources)}

    def eta(amount: float) -> np.ndarray:
        off = moved(STATED, field, amount)
        return TyreModel(off, Evaluator(TyreDesign(off)), ROWS, [], {}).values_at(model.start)

    for name in (f"{SECTION}meridian 2", f"{SECTION}gauge 1"):
        field = fields(STATED)[name]
        wide, narrow = ((eta(step) - eta(-step)) / (2 * step) for step in (0.2, 0.1))
        assert abs(column[name]).max() > 3e-3
        wanted = (4 * narrow - wide) / 3
        assert column[name] == pytest.approx(wanted, abs=1e-5 * abs(wanted).max())
    names = [n for n in column if n.startswith(f"{SECTION}density")]
    shapes = np.array([fields(STATED)[n].values for n in names])
    all_up = np.linalg.solve(shapes.T, np.full(shapes.shape[1], 0.015))  # z of a uniform change
    together = np.array([column[n] for n in names]).T @ all_up
    assert together[:-1] == pytest.approx(column["rubber_density"][:-1], abs=2e-5)
    assert together[-1] == pytest.approx(column["rubber_density"][-1], abs=2e-6)
    z = {name: 0.2 * (-1) ** i for i, name in enumerate(fields(STATED))}  # a tyre as it may be
    drawn = Evaluator(TyreDesign(with_fields(STATED, z)))
    ((_, tyre),) = find_modes(drawn, [Question({})], LABELS)
    assert isinstance(tyre, LabelledModes)
    ln_f = [np.log(tyre.wanted[label].frequency_Hz) for label in LABELS]
    own = np.append(ln_f, np.log(tyre.evaluation.mass_kg)) - at_0.eta
    by_slopes = sum(amount * column[name] for name, amount in z.items())
    assert own == pytest.approx(by_slopes, abs=0.03 * abs(by_slopes).max())


def test_the_statement_is_none_of_the_tyre() -> None:
    """The same hash, so that results of either go together."""
    assert tyre_sha256(STATED) == tyre_sha256(CASE)


@pytest.mark.slow
def test_what_is_told_of_the_section_holds_within_its_standard_deviation(chance: Chance) -> None:
    """Fields drawn on the toy, whose sources are those of the case with slopes by chance.

    False failures: 1e-7.
    """
    own_sources = sources(STATED)[0]
    toy, own = Toy(effects=1, bend=0.0), fields(STATED)
    toy.sources = tuple(source.name for source in own_sources)  # type: ignore[assignment]
    toy.constants = np.random.default_rng(5).normal(0, 0.005, (len(toy.rows), len(own_sources)))
    base, off = problem(toy), []
    for _ in range(10):
        z = chance.random.normal(size=len(own_sources))
        y = toy.base + toy.constants @ z + chance.random.normal(0, 0.00224, len(toy.base))
        seen = base.measured(y).observations
        stated = Assumed(form=0.001, response_error=0.0)
        d = diagnose(toy, toy.rows, seen, assumed=stated)  # type: ignore[arg-type]
        posterior = section_posterior(STATED, own_sources, d)
        assert {v.field for v in posterior} == {"meridian", "hold", "gauge", "stiffness", "density"}
        assert all(0 < v.sigma <= v.before for v in posterior)
        value = next(v for v in posterior if v.field == "meridian")
        place = sum(stations(STATED.section, value.place)) // 2
        true = 1e3 * sum(
            own[source.name].values[place] * amount
            for source, amount in zip(own_sources, z, strict=True)
            if source.field and source.field.kind == "meridian"
        )
        off.append((value.value - true) / value.sigma)
    chance.normal(off)


@pytest.mark.slow
def test_a_bead_that_yields_is_held_further_down(tmp_path: Path) -> None:
    """Whether the rim holds the whole bead or its surface is what two standard deviations of its
    hold are, in every mode to a quarter of the largest shift; the belt does not move. This is with
    cords that bear compression: slack ones move all but [0,0] torsional by less than 1 %."""
    draft = from_size(parse_size("205/60R15"), {}, None, "made")
    (tmp_path / draft.file).write_bytes(draft.content)
    (tmp_path / "made.yaml").write_text(draft.text.replace("level: default", "level: coarse"))
    slack = load_case(tmp_path / "made.yaml")
    cords = {n: m for n, m in slack.case.materials.items() if isinstance(m, Cord)}
    stiff = {name: with_part(cord, bears_compression=True) for name, cord in cords.items()}
    whole = changed(slack, materials={**slack.case.materials, **stiff})
    surface = changed(whole, rim=with_part(whole.case.rim, holds="bead_surface"))
    (field,) = [each for each in fields(whole).values() if each.kind == "hold"]
    assert not [each for each in fields(CASE).values() if each.kind == "hold"]  # exact
    lower = moved(whole, field, -2.0)
    edge = belt_edge(whole)
    np.testing.assert_array_equal(
        lower.section.points[:, : edge + 1], whole.section.points[:, : edge + 1]
    )
    held, yields, slid = (frequencies(case) for case in (whole, surface, lower))
    shift, alike = np.log(yields / held), np.log(slid / held)
    assert shift[0] < -0.04 and (shift < 0).all()
    assert alike == pytest.approx(shift, abs=0.25 * abs(shift).max())


def frequencies(case: LoadedCase) -> Array:
    """Hz by label."""
    evaluation = Evaluator(TyreDesign(case)).evaluate(Question(start_values(case)))
    labels = modes_result(case, start_values(case), evaluation)[0].modes
    return np.array([m.frequency_Hz for m in sorted(labels, key=lambda m: (m.c, m.m, str(m.kind)))])
