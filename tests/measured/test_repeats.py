"""Combination of repeats: the mean of their values, and how far it may be off."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest
from scipy.stats import t

from tyrecal.errors import InputError
from tyrecal.measured.measurement import Measurement, measurements_csv
from tyrecal.measured.repeats import _order, combined
from tyrecal.simulate.modes.label import Label

from ..chance import Chance

pytestmark = pytest.mark.numbers

LABELS = [Label(c, m) for c in (1, 2, 3, 4) for m in (0, 1)]


def value(
    hertz: float, run: str, label: Label = LABELS[0], member: str = "", sigma: float = nan
) -> Measurement:
    return Measurement("frequency_Hz", label, member, 240.0, 0.0, hertz, sigma, run, "here")


def test_sigma_covers_the_truth_from_three_runs(chance: Chance) -> None:
    """Shares within one and two sigma of all eight modes, as of Student's t with the 16 degrees of
    freedom that they have together.

    False failures: 2e-7.
    """
    truth = np.linspace(40, 120, len(LABELS))
    within = []
    for _ in range(200):
        runs = [
            value(f * (1 + 0.002 * chance.random.standard_normal()), str(k), label)
            for k in range(3)
            for f, label in zip(truth, LABELS, strict=True)
        ]
        rows = {row.label: row for row in combined(runs, floor=0.0)}
        z = [(rows[x].value - f) / rows[x].sigma for x, f in zip(LABELS, truth, strict=True)]  # type: ignore[operator]
        within.append([np.mean(np.abs(z) < k) for k in (1, 2)])
    for k, shares in zip((1, 2), np.transpose(within), strict=True):
        share = 1 - 2 * t(16).sf(k)
        chance.mean(shares, share - 0.02, share + 0.02)


def test_of_one_label_alone_it_is_the_textbooks() -> None:
    x = [66.0, 66.2, 66.4, 66.1]
    (row,) = combined([value(f, str(k)) for k, f in enumerate(x)], floor=0.0)
    assert row.value == pytest.approx(np.mean(x))
    assert row.sigma == pytest.approx(np.std(x, ddof=1) / 2, rel=1e-3)


def test_what_runs_state_counts_where_they_scatter_less() -> None:
    (row,) = combined([value(66.0, "1", sigma=0.4), value(66.0, "2", sigma=0.3)])
    assert row.sigma == pytest.approx(0.25)
    (row,) = combined([value(66.0, "1"), value(66.0, "2")], assumed=0.01)
    assert row.sigma == pytest.approx(0.66 / np.sqrt(2))


def test_no_sigma_is_below_the_floor() -> None:
    (row,) = combined([value(66.0, "1"), value(66.0, "2")], floor=0.002)
    assert row.sigma == pytest.approx(0.132)


def test_a_single_value_without_sigma_is_refused() -> None:
    with pytest.raises(InputError, match=r"nothing states how far \[1,0\] may be off"):
        combined([value(66.0, "1")])


def test_a_doublet_is_one_value_where_a_run_saw_only_one() -> None:
    two = [value(66.0, "1", member="1"), value(66.4, "1", member="2")]
    rows = combined([*two, value(66.1, "2", member="1"), value(66.5, "2", member="2")])
    assert [(row.member, row.value) for row in rows] == [
        ("1", pytest.approx(66.05)),
        ("2", pytest.approx(66.45)),
    ]
    (row,) = combined([*two, value(66.3, "2")])
    assert (row.member, row.value) == ("", pytest.approx(66.25))


def test_a_lone_member_stays_one() -> None:
    """A diagnosis gives it half the usual split more, so it must not pass for the pair's value."""
    (row,) = combined([value(66.0, "1", member="1"), value(66.2, "2", member="1")])
    assert (row.member, row.value) == ("1", pytest.approx(66.1))
    (row,) = combined([value(66.0, "1", member="2", sigma=0.1)])
    assert row.member == "2"
    (row,) = combined([value(66.0, "1", member="1"), value(66.4, "2", member="2")])
    assert row.member == ""


@pytest.mark.parametrize(
    "runs", [[value(66.0, "1", sigma=40.0)], [value(30.0, "1"), value(90.0, "2")]]
)
def test_a_sigma_that_no_fit_would_read_is_refused(runs: list[Measurement]) -> None:
    with pytest.raises(InputError, match=r"sigma of \[1,0\] is .* more than 20 %"):
        combined(runs)


def test_the_csv_is_sorted_and_whole() -> None:
    rows = combined([value(70.0, "1", LABELS[2], sigma=0.1), value(66.0, "1", sigma=0.123456)])
    assert measurements_csv(rows).splitlines() == [
        "quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma",
        "frequency_Hz,1,0,,,240,0,66,0.123",
        "frequency_Hz,2,0,,,240,0,70,0.1",
    ]


def test_rows_come_by_quantity_state_and_mode() -> None:
    """Frequencies first, by pressure and load; [0,0] by its kind, then c, m and the member."""
    at = lambda label, member="", pressure=240.0, load=0.0: Measurement(
        "frequency_Hz", label, member, pressure, load, 50.0
    )
    area = Measurement("contact_area_m2", None, "", 160.0, 4e3, 0.02)
    wanted = [
        at(Label(9, 3), pressure=160.0),
        at(Label(0, 0, "axial")),
        at(Label(0, 0, "torsional")),
        at(Label(0, 1)),
        at(Label(1, 0), "1"),
        at(Label(1, 0), "2"),
        at(Label(1, 0), load=10.0),
        area,
    ]
    assert sorted(wanted[::-1], key=_order) == wanted
