"""A ply on a surface of the section, and regions of a single station."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.parts import Gauge
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.section.section import regions_of

from ..effects.support import CASE, START


def with_carcass_on(line: str, liner: float) -> LoadedCase:
    """The carcass on a line of the section whose liner is ``liner`` times as thick."""
    case = CASE.case
    layers = {**case.rebar_layers}
    layers["carcass"] = layers["carcass"].model_copy(update={"line": line})
    gauges = 2 * [Gauge(between=["inner", "ply"], factor=liner**0.5)]
    section = case.section.model_copy(update={"gauges": gauges})
    return replace(CASE, case=case.model_copy(update={"rebar_layers": layers, "section": section}))


def test_a_ply_on_the_inner_surface_is_the_limit_of_one_just_inside() -> None:
    """Frequencies differ by the liner's thickness, at first order."""
    apart = []
    for liner in (0.02, 0.01):
        evaluations = [
            Evaluator(TyreDesign(with_carcass_on(line, liner))).evaluate(Question(START))
            for line in ("ply", "inner")
        ]
        inside, on = ([m.frequency_Hz for m in each.modes] for each in evaluations)
        apart.append(np.array(on) / np.array(inside) - 1)
    assert (apart[1] != 0).all()
    # terms of second order: a fiftieth, the liner's share of itself
    assert apart[0] == pytest.approx(2 * apart[1], abs=0.02 * abs(apart[0]).max())


def test_plies_on_surfaces_have_elements_of_their_own() -> None:
    """Numbered apart from solids and other plies, along the faces of the outermost solids."""
    mesh = resolved(CASE).mesh
    numbers = [n for cords in mesh.cords.values() for n in cords] + list(mesh.solids)
    assert len(set(numbers)) == len(numbers)
    for line, solids, face in (("inner", mesh.inner, (0, 3)), ("outer", mesh.outer, (1, 2))):
        ends = [(nodes[0], nodes[-1]) for nodes in mesh.cords[line].values()]
        assert ends == [tuple(mesh.solids[n][k] for k in face) for n in solids]
        assert [mesh.region_of(n) for n in mesh.cords[line]] == [mesh.cells[n][0] for n in solids]


@pytest.mark.parametrize(
    ("labels", "rigid", "regions"),
    [
        ("abbcc", "00011", {"a": 1, "b": 2, "c": 1}),  # alone at the crown: the interval behind it
        ("aabcc", "00011", {"a": 1, "b": 2, "c": 1}),
        ("aaabb", "00011", {"a": 3, "b": 1}),
        ("aabc", "0001", {"a": 1, "b": 1, "c": 1}),  # alone under the rim: the one before it
        ("aaabc", "00011", {"a": 2, "b": 1, "c": 1}),
        ("abcd", "0000", {"a": 1, "b": 1, "c": 1}),
    ],
)
def test_a_region_of_one_station_has_an_interval(
    labels: str, rigid: str, regions: dict[str, int]
) -> None:
    by_region = dict(regions_of(list(labels), [flag == "1" for flag in rigid]))
    if len(regions) < len(set(labels)):  # no interval for each: refused where the table is read
        assert min(by_region.values()) < 1
    else:
        assert by_region == regions
    assert sum(by_region.values()) == len(labels) - 1
