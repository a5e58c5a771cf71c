"""The source of error by cords that are slack: which layers, which pressures, how much."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.compressed_cords import (
    by_share,
    compressed_layers,
    slack_layers,
    with_compression,
)
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.case import LoadedCase, with_level

from ..studies import wrinkles
from .coarse_model import CASE


@pytest.fixture(scope="module")
def car() -> LoadedCase:
    return with_level(wrinkles.by_size("205/60R15"), "coarse")


def test_layers_of_textile_may_be_slack(car: LoadedCase) -> None:
    assert slack_layers(car) == ["carcass", "carcass_turn_up", "cap_ply"]
    assert not slack_layers(CASE)
    bears = with_compression(car, "carcass_turn_up")
    assert slack_layers(bears) == ["carcass", "cap_ply"]
    assert not slack_layers(wrinkles.with_compression(car, True))


def test_a_share_is_any_from_none_to_all() -> None:
    """Its mean square is 1/3, that of two pressures 1/6."""
    shift, kPa = np.array([0.03, 0.01, 0.02]), np.array([160.0, 160.0, 320.0])
    columns = by_share(shift, kPa, [160.0, 320.0])
    alike = np.array([[2, 2, 1], [2, 2, 1], [1, 1, 2]]) / 6
    assert columns @ columns.T == pytest.approx(alike * np.outer(shift, shift))


@pytest.mark.slow
def test_a_diagnosis_does_not_know_what_compressed_cords_bear(car: LoadedCase) -> None:
    """The columns are the change where all of a layer bears compression, next to the slack tyre."""
    evaluator = Evaluator(TyreDesign(car))
    rows = [(label, kPa) for kPa in (160.0, 320.0) for label in (Label(1, 1), Label(3, 0))]
    own = sources(car)[0]
    model = TyreModel(car, evaluator, rows, own, effect_ranges(car, evaluator, ["cap_ply"])[0])
    (answer,) = model.answers([Query(model.start, constants=True)])
    assert isinstance(answer, Answer) and answer.constants is not None
    assert answer.constants.shape == (4, len(model.sources)) == (4, len(own) + 9)
    at = model.sources.index("compression of carcass_turn_up")
    borne = with_compression(car, "carcass_turn_up")
    (other,) = TyreModel(borne, evaluator, rows, [], {}).answers([Query(model.start)])
    assert isinstance(other, Answer)
    wanted = by_share(other.eta - answer.eta, np.array([160.0, 160.0, 320.0, 320.0]), [160, 320])
    assert answer.constants[:, at : at + 3] == pytest.approx(wanted, abs=1e-7)
    assert abs(wanted).max() > 1e-3
    assert compressed_layers(model.sources) == slack_layers(car)
    assert not compressed_layers(TyreModel(car, evaluator, rows, own, {}).sources)
