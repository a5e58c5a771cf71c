"""Slips as the study draws them, and a hundredth of the study itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.measured.measurement import Measurement

from . import slips
from .fit_errors import LABELS, SIZES, case_of, drawn
from .slips import DECIMAL, DIGIT, DIGITS, PRESSURES, ROWS, is_named, with_slip

HERTZ = (31.7, 35.0, 58.5, 37.8, 79.5, 66.1, 97.6, 102.7, 115.9)
ROWS_OF_TABLE = [
    Measurement("frequency_Hz", label, "", p, 0.0, round(f * (p / 200) ** 0.4, 1), 0.003 * f)
    for p in (200.0, 250.0)
    for label, f in zip(LABELS, HERTZ, strict=True)
]


@pytest.mark.parametrize("kind", slips.SLIPS)
def test_a_drawn_slip_is_of_its_kind_and_large_enough(kind: str) -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        slipped, wrong = with_slip(ROWS_OF_TABLE, kind, random)
        changed = [i for i in range(18) if slipped[i].value != ROWS_OF_TABLE[i].value]
        pairs = [(ROWS_OF_TABLE[i].value, slipped[i].value) for i in wrong]
        assert changed == list(wrong)
        assert np.mean([abs(b / a - 1) for a, b in pairs]) > 0.02
        if kind == DECIMAL:
            assert max(pairs[0]) == pytest.approx(10 * min(pairs[0]))
        elif kind == DIGITS:
            before, after = (f"{each:.1f}" for each in pairs[0])
            assert sorted(before.zfill(6)) == sorted(after.zfill(6))
        elif kind == DIGIT:
            before, after = (f"{each:.1f}".zfill(6) for each in pairs[0])
            assert sum(a != b for a, b in zip(before, after, strict=True)) == 1
        elif kind == ROWS:
            assert pairs[0] == pairs[1][::-1] and wrong[1] == wrong[0] + 1
        else:
            assert kind == PRESSURES and wrong == tuple(range(18))


def test_the_right_row_or_exchange_has_to_be_named() -> None:
    row = "measured.csv, line 4: [1,0] is 85.5 Hz: is it a slip?"
    assert is_named(DIGIT, (2,), row)
    assert not is_named(DIGIT, (3,), row)
    other = f"{row} Nearly as likely: measured.csv, line 5: ..."
    assert is_named(DIGIT, (2,), other) and not is_named(DIGIT, (3,), other)
    assert not is_named(ROWS, (2, 3), row)
    both = "measured.csv, line 4, measured.csv, line 5: are the two labels exchanged?"
    assert is_named(ROWS, (2, 3), both)
    assert not is_named(PRESSURES, range(18), both)
    assert not is_named(DIGIT, (2,), "")


@pytest.mark.slow
def test_a_slip_in_the_table_of_a_drawn_tyre_is_named(tmp_path: Path) -> None:
    """[2,0] is off by 8 %, 27 standard deviations, so no drawn scatter hides it."""
    case = case_of(SIZES[0])
    rows = slips.table_of(drawn(case, np.random.default_rng(3))[0])
    rows[4] = replace(rows[4], value=round(1.08 * rows[4].value, 1))
    judgement = slips.judged(case, rows, tmp_path)
    assert is_named(DIGIT, (4,), judgement.first)
    assert judgement.verdict == "does_not_fit"
