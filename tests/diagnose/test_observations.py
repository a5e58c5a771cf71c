"""Observations: pairs as mean and split, repeats, and what is left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.measured.measurement import Measurement
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.observations import observe

from ..chance import Chance
from ..measured.test_measurements import GOOD, read

pytestmark = pytest.mark.numbers


def test_a_pair_is_a_mean_and_a_split_whichever_comes_first(tmp_path: Path) -> None:
    low, high = "frequency_Hz,2,0,,{},240,0,79.0,0.2", "frequency_Hz,2,0,,{},240,0,80.0,0.3"
    one = observe(read(tmp_path, low.format(1), high.format(2)))
    other = observe(read(tmp_path, high.format(1), low.format(2)))
    for observations in (one, other):
        assert observations.y == pytest.approx([np.log(79.0 * 80.0) / 2])
        assert observations.split == pytest.approx([np.log(80 / 79)])
    sa, sb = 0.2 / 79, 0.3 / 80
    assert one.scatter == pytest.approx([np.hypot(sa, sb) / 2])
    assert one.split_scatter == pytest.approx([np.hypot(sa, sb)])


def test_a_lone_member_carries_half_the_usual_split(tmp_path: Path) -> None:
    line = "frequency_Hz,2,0,,1,240,0,80.0,0.2"
    lone = observe(read(tmp_path, line), split=0.004)
    assert lone.scatter == pytest.approx([np.hypot(0.2 / 80, 0.002)])
    assert np.isnan(lone.split[0])


def test_repeats_tell_the_scatter_and_what_a_run_shares(chance: Chance) -> None:
    """Two ways of scatter, drawn and found again: mean variances over 300 tyres within 4 %.

    False failures: 2e-7.
    """
    random = chance.random
    labels = [Label(c, m) for c in range(1, 7) for m in (0, 1)]
    own, shared = [], []
    for _ in range(300):
        runs = []
        for _ in range(3):
            common = random.normal(0, 0.004)
            runs.append(
                [
                    Measurement(
                        "frequency_Hz",
                        x,
                        "",
                        240.0,
                        0.0,
                        50 * np.exp(common + random.normal(0, 0.002)),
                        5.0,
                    )
                    for x in labels
                ]
            )
        observations = observe(runs[0], runs[1:])
        own.append(np.mean(observations.scatter**2) * 3 / 0.002**2)
        shared.append(observations.common**2 * 3 / 0.004**2)
    chance.mean(own, 0.96, 1.04)
    chance.mean(shared, 0.96, 1.04)


def test_what_is_not_used_is_said(tmp_path: Path) -> None:
    lines = [
        GOOD,
        "contact_area_m2,,,,,240,4000,0.02,0.001",
        "frequency_Hz,1,0,,symmetric,240,4000,70,0.5",
    ]
    run = read(tmp_path, *lines)
    observations = observe(run, [], [run])  # of the first run it is compared, not left out
    assert len(observations.rows) == 2 and len(observations.left_out) == 2
    assert (
        "contact_area_m2" in observations.left_out[0] and "under load" in observations.left_out[1]
    )
    assert all(words.startswith("measured.csv, line ") for words in observations.left_out)


def test_repeats_that_cannot_be_used_are_said(tmp_path: Path) -> None:
    both = [GOOD, "frequency_Hz,3,0,,,240,0,98,0.2", "frequency_Hz,4,0,,,240,0,116,0.2"]
    again = [
        "frequency_Hz,3,0,,,240,0,98.4,0.2",
        "frequency_Hz,4,0,,,240,0,116.3,0.2",
        "frequency_Hz,1,0,,,240,0,58,0.2",
    ]
    observations = observe(read(tmp_path, *both), [read(tmp_path, *again)])
    assert len(observations.rows) == 3 and observations.y[0] == pytest.approx(np.log(79.5))
    assert observations.left_out == (
        "repeats of [2,0] at 240 kPa: not in every file, the first one's value and sigma hold",
        "[1,0] at 240 kPa: in repeats only",
    )
    alone = observe(read(tmp_path, *both), [read(tmp_path, again[0])])
    assert any(words.startswith("all repeats: fewer than two") for words in alone.left_out)
    assert not observe(read(tmp_path, *both), [read(tmp_path, *both)]).left_out


def test_a_toggled_run_is_no_repeat(tmp_path: Path) -> None:
    """It may have other modes, and its values do not enter the scatter."""
    lines = [GOOD, "frequency_Hz,3,0,,,240,0,98,0.2", "frequency_Hz,4,0,,,240,0,116,0.2"]
    again = [
        "frequency_Hz,2,0,,,240,0,79.7,0.2",
        "frequency_Hz,3,0,,,240,0,98.1,0.2",
        "frequency_Hz,4,0,,,240,0,115.8,0.2",
    ]
    run, repeat = read(tmp_path, *lines), read(tmp_path, *again)
    toggled = read(tmp_path, lines[0], "frequency_Hz,1,0,,,240,0,40,0.3")
    for repeats in ([], [repeat]):
        alone, observations = observe(run, repeats), observe(run, repeats, [toggled])
        assert not observations.left_out and observations.common == alone.common
        assert observations.y[:3] == pytest.approx(alone.y)
        assert observations.scatter[:3] == pytest.approx(alone.scatter)
        assert observations.y[3:] == pytest.approx(np.log([40, 79.5]))
        assert observations.scatter[3:] == pytest.approx([0.3 / 40, 0.2 / 79.5])
        assert [row.run for row in observations.rows] == [0, 0, 0, 1, 1]


def test_the_scatter_of_repeats_by_the_analysis_of_variance() -> None:
    """Two ways without interaction (values, runs), 4 values in 3 runs: mean squares over their
    degrees of freedom; each value's own variance counts 2 of 6 parts beside the pooled one."""
    table = np.random.default_rng(4).normal(0, 0.003, (4, 3)) + np.array([0.01, 0.0, -0.02])
    runs = [
        [
            Measurement("frequency_Hz", Label(c + 1, 0), "", 240.0, 0.0, 50 * np.exp(y), 1.0)
            for c, y in enumerate(column)
        ]
        for column in table.T
    ]
    observations = observe(runs[0], runs[1:])
    rest = [
        [y - table[i].mean() - table[:, k].mean() + table.mean() for k, y in enumerate(row)]
        for i, row in enumerate(table)
    ]
    squares = np.sum(np.square(rest), axis=1)
    pooled = squares.sum() / ((4 - 1) * (3 - 1))
    between_runs = 4 * np.sum((table.mean(0) - table.mean()) ** 2) / (3 - 1)
    assert observations.y == pytest.approx(np.log(50) + table.mean(1))
    assert observations.common**2 == pytest.approx((between_runs - pooled) / 4 / 3)
    assert observations.scatter**2 == pytest.approx((4 * pooled + squares) / (4 + 2) / 3)
