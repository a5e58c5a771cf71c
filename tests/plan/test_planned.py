"""Campaigns on record, judged by the diagnosis, against what the plan promised."""

from __future__ import annotations

import numpy as np
import pytest

from ..studies.planned import cost, groups, of_judge, promised, read

JUDGES = "linear", "evidence"


@pytest.mark.parametrize("judge", JUDGES)
def test_effects_are_found_as_often_as_promised(judge: str) -> None:
    rows = read()
    for share, stated, error in promised(rows, of_judge(rows, judge)[0]).values():
        assert abs(share - stated) <= 3 * error


@pytest.mark.parametrize("judge", JUDGES)
def test_a_plan_reaches_a_verdict_sooner_than_the_list(judge: str) -> None:
    """By how much is in PLAN.md."""
    rows = read()
    for of in groups(of_judge(rows, judge)[0]).values():
        listed, own = (cost(of, way, rows[0]["list_hours"]) for way in ("list", "plan"))
        assert own.mean() < listed.mean() and np.median(own) <= np.median(listed)


def test_no_sound_tyre_is_accused() -> None:
    rows = read()
    for judge in JUDGES:
        sound = of_judge(rows, judge)[1]
        assert sound and not [row for row in sound if row["accused"] >= 0.9]
