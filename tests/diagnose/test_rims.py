"""A tyre measured on several rims: each row is of its own state, what holds the rim acts on its own
rim alone, and a gap of the tyre is named from all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.measured.tables import read_measurements
from tyrecal.measured.targets import in_states
from tyrecal.report.diagnosis import page
from tyrecal.report.diagnosis_pictures import draw_residuals
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.result import Residual, diagnosis_result
from tyrecal.studies.diagnose.study import study
from tyrecal.studies.inference.covariance import BETWEEN_RIMS, alike
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.model import Answer, ModelRow, Query
from tyrecal.studies.inference.observations import Observable, observe
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.state import TyreState
from tyrecal.tyre.values import with_values

from ..chance import generator
from ..effects.support import coarse

pytestmark = pytest.mark.numbers

CASE = coarse()
FREE = TyreState(240.0, 0.0, "free")
LABELS = (Label(0, 0, "axial"), Label(0, 0, "torsional"), Label(1, 1), Label(1, 0), Label(2, 0))
ROWS: list[ModelRow] = [*((x, 240.0) for x in LABELS), *((x, FREE) for x in LABELS)]
EFFECTS = ("spindle_lateral", "belt_width")
FIXED_ROWS, FREE_ROWS = slice(0, 5), slice(5, 10)


def model(rows: list[ModelRow] = ROWS, effects: tuple[str, ...] = EFFECTS) -> TyreModel:
    evaluator = Evaluator(TyreDesign(CASE))
    ranges, _ = effect_ranges(CASE, evaluator, list(effects))
    return TyreModel(CASE, evaluator, rows, sources(CASE)[0], ranges)


@pytest.mark.slow
def test_each_row_is_of_its_own_rim() -> None:
    """As two cases have them, one a rim; the spindle moves [0,0] lateral on it, nothing that hangs;
    slopes on both against differences."""
    own, step = model(), 1e-4
    x = own.start
    d = np.array([0, 0, step])
    queries = [Query(x, constants=True), Query(x + d), Query(x - d)]
    plain, above, below, held = own.answers([*queries, Query(x, {"spindle_lateral": 2e-7})])
    assert all(isinstance(each, Answer) for each in (plain, above, below, held))
    free = with_values(CASE, {"rim.free": True})
    alone = TyreModel(free, Evaluator(TyreDesign(free)), ROWS[:5], [], {})
    (hung,) = alone.answers([Query(x)])
    assert plain.eta[FREE_ROWS] == pytest.approx(hung.eta, abs=1e-9)  # type: ignore[union-attr]
    slope = (above.eta - below.eta) / (2 * step)  # type: ignore[union-attr]
    assert plain.jacobian[:, 2] == pytest.approx(slope, abs=2e-5)  # type: ignore[union-attr]
    shift = held.eta - plain.eta  # type: ignore[union-attr]
    assert shift[0] < -0.05 and not shift[FREE_ROWS].any()
    # waves that do not move the rim
    assert plain.eta[9] == pytest.approx(plain.eta[4], abs=1e-6)  # type: ignore[union-attr]
    assert plain.constants[9] == pytest.approx(plain.constants[4], abs=1e-5)  # type: ignore[union-attr,index]


def test_an_observation_says_its_rim(tmp_path: Path) -> None:
    readings = in_states(CASE, read_measurements(written(tmp_path, np.log(np.full(10, 80.0)))))
    rows = observe(readings).rows
    assert [row.row for row in rows] == sorted(
        ROWS,
        key=lambda row: (row[1] == FREE, row[0].c, row[0].m, row[0].kind or ""),  # type: ignore[union-attr]
    )
    same = alike(rows)
    assert same[0, 5] == same[4, 9] == BETWEEN_RIMS and same[0, 6] == 0
    assert str(rows[9]) == "[2,0] at 240 kPa, rim free"
    for row in rows:
        observable = Residual(row=str(row), run=0, percent=1.0, sigma_percent=1.0).of
        assert observable and (observable.label, observable.state) == (row.label, row.state)
    assert Observable.of(rows[9].row) == rows[9]


def written(folder: Path, eta: np.ndarray, sigma: float = 1e-3) -> Path:
    """A table of measurements of ``ROWS``, with scatter."""
    random, lines = generator(17), ["quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma,rim"]
    for (label, where), y in zip(ROWS, eta, strict=True):
        assert label
        f = float(np.exp(y + sigma * random.normal()))
        rim = "free" if where == FREE else "fixed"
        place = f"{label.c},{label.m},{label.kind or ''},,240,0"
        lines.append(f"frequency_Hz,{place},{f!r},{sigma * f!r},{rim}")
    path = folder / "rims.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.slow
def test_a_spindle_is_named_from_both_rims(tmp_path: Path) -> None:
    """Its size within four standard deviations. False failures: 6e-5, were it drawn anew."""
    own = model()
    x = own.start + np.array([0.1, -0.1, 0.1])
    (answer,) = own.answers([Query(x, {"spindle_lateral": 1e-7})])
    assert isinstance(answer, Answer)
    path = written(tmp_path, answer.eta, 3e-3)
    with path.open("a") as file:
        file.write("frequency_Hz,2,0,,symmetric,240,4000,88,0.4,free\n")
    evaluator = Evaluator(TyreDesign(CASE))
    result = study(CASE, evaluator, path, effects=list(EFFECTS), section_map=False)
    diagnosis = diagnosis_result(result.diagnosis)
    assert diagnosis.verdict == "named" and diagnosis.effect == "spindle_lateral"
    size = diagnosis.parameter
    assert size and abs(size.value - 1e-7) < 4 * (size.high - size.low) / (2 * 1.645)
    assert diagnosis.left_out == [
        "rims.csv: what was measured under load with the rim free: not compared"
    ]
    assert set(diagnosis.gap.by_rim) == {"as the case", "free"}
    assert "5 modes at 240 kPa, rim as the case and free" in page(result, "tyre", path.name)
    gap, rows = result.diagnosis.gap, result.diagnosis.problem.observations.rows
    legend = draw_residuals(rows, gap.residuals, gap.spread).legends[0]
    assert [text.get_text() for text in legend.texts] == ["240 kPa", "240 kPa, rim free"]
