"""Effects that a test could detect, judged before anything is measured, against lambda by its
formula."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tyrecal.studies.blind.protocol import Protocol
from tyrecal.studies.blind.ruler import measure, ruler_of
from tyrecal.studies.fit.targets import USUAL_LABELS, labels_to_measure
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.separability import VISIBLE
from tyrecal.tyre.case.schema import Targets

from .study3.power import NAMED_AS_A_RULE, powers
from .toy import CASE, Scale, protocol

SCALE = Scale()

RULER = ruler_of(measure(SCALE, SCALE.model_rows))
RULES = protocol()
FOUND = {power.id: power for power in powers(RULER, RULES)}


def test_all_designs_are_asked_for_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the progress has one total, and workers always something to do."""
    scale, counts = Scale(), list[int]()
    answers = scale.answers

    def counted(points: Sequence[Query]) -> list[Answer | Exception]:
        counts.append(len(points))
        return answers(points)

    monkeypatch.setattr(scale, "answers", counted)
    measure(scale, scale.model_rows)
    assert len(counts) == 1 and counts[0] > 3 * len(scale.ranges)


def lam(id: str, e: float) -> float:
    """lambda by shift, covariance and projection, of rows that are given."""
    rows = [i for i, (x, p) in enumerate(SCALE.model_rows) if not x or p in RULES.given_kPa]
    at = np.array(rows)
    labels = [SCALE.model_rows[i][0] for i in rows]
    counts = np.array([2 if label and label.c else 1 for label in labels])
    P = RULER.projection(np.zeros(3), at, RULER.sigma(at, counts, RULES))
    shift = np.append(0.0, e * SCALE.g[id])[at]
    return float(shift @ P @ shift)


@pytest.mark.parametrize("id", sorted(SCALE.g))
def test_sizes_are_where_lambda_is_ten_and_twenty_five(id: str) -> None:
    power = FOUND[id]
    assert power.full == pytest.approx(lam(id, 1.0), rel=1e-4)
    for size, least in ((power.seen, VISIBLE), (power.named, NAMED_AS_A_RULE)):
        assert (size is None) == (power.full < least)
        if size is not None:
            assert lam(id, size) == pytest.approx(least, rel=1e-3)


def test_pressures_lie_about_the_tyres_own_and_any_tyre_has_modes() -> None:
    assert Protocol("", "", {}).about(240.0) == Protocol("", "", {})
    truck = Protocol("", "", {}).about(830.0)
    assert truck.given_kPa == (553, 830, 1107) and truck.held_out_kPa == 692
    bare = replace(CASE, case=CASE.case.model_copy(update={"targets": Targets()}))
    assert set(labels_to_measure(bare)) == set(labels_to_measure(CASE)) == set(USUAL_LABELS)
