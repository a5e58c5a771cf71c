"""The verdict of a fit and the likeliest reason, on small linear models with a known slip."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.api import evaluate_modes, load_case, with_values
from tyrecal.measured.measurement import Measurement
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.fit.verdict import (
    Remainder,
    Shift,
    fit_verdict,
    likeliest_reason,
    likely_value,
)

from ..cli.test_cli import run
from ..conftest import CASES

pytestmark = pytest.mark.numbers

Array = np.ndarray
SIGMA = 0.003
LABELS = [Label(0, 0, "axial"), Label(0, 0, "torsional")]
LABELS += [Label(c, m) for c in (1, 2, 3, 4) for m in (0, 1)]
HERTZ = np.array([31.7, 35.0, 58.5, 37.8, 79.5, 66.1, 97.6, 102.7, 115.9, 131.2])
J = np.array(  # by two variables, each in a line
    [
        [0.10, 0.30, 0.20, 0.15, 0.30, 0.10, 0.25, 0.05, 0.20, 0.04],
        [0.50, 0.20, 0.30, 0.10, 0.10, 0.20, 0.05, 0.25, 0.02, 0.30],
    ]
).T
PRESSURES = (200.0, 250.0)


def remainder(values: Array, model: Array, J: Array, pressures: Sequence[float]) -> Remainder:
    """Residuals of all modes at each pressure in turn, one line of a file each."""
    rows = [
        Measurement("frequency_Hz", label, "", p, 0.0, float(f), SIGMA * f, "", f"t.csv, line {k}")
        for k, (label, p, f) in enumerate(
            zip(LABELS * len(pressures), np.repeat(pressures, len(LABELS)), values, strict=True), 2
        )
    ]
    return Remainder(rows, np.log(values / model), np.eye(len(rows)) * SIGMA**2, J)


def two_pressures(values: Array) -> Remainder:
    """The model is right but for its two variables."""
    return remainder(
        values, model_Hz() * np.exp(np.vstack([J, J]) @ [0.02, -0.01]), np.vstack([J, J]), PRESSURES
    )


def model_Hz() -> Array:
    rise = 0.3 + 0.1 * np.sin(np.arange(len(LABELS)))
    return np.concatenate([HERTZ * (p / 200) ** rise for p in PRESSURES])


def noisy(seed: int = 1) -> Array:
    noise = np.random.default_rng(seed).standard_normal(2 * len(LABELS))
    return model_Hz() * np.exp(SIGMA * noise)


def test_chi2_is_that_of_the_best_design() -> None:
    """Whatever design the residuals are about; one value less for each variable."""
    left = two_pressures(noisy())
    d, both = np.log(noisy() / model_Hz()), np.vstack([J, J])
    best = d - both @ np.linalg.lstsq(both, d, None)[0]
    assert left.freedom == 18
    assert left.chi2_per_dof == pytest.approx(best @ best / SIGMA**2 / 18)
    assert likeliest_reason(left) is None
    assert replace(left, is_stated=False).chi2_per_dof is None
    alone = Remainder(left.rows[:2], left.deviation[:2], np.eye(2), J[:2])
    assert alone.chi2_per_dof is None and likeliest_reason(alone) is None


@pytest.mark.parametrize(
    ("good", "per_dof", "verdict"),
    [
        (True, 5.0, "fits"),
        (True, 5.01, "does_not_fit"),
        (True, None, "not_judged"),
        (False, 5.01, "not_converged"),
    ],
)
def test_the_verdict(good: bool, per_dof: float | None, verdict: str) -> None:
    assert fit_verdict(good, per_dof) == verdict


@pytest.mark.parametrize(("i", "value"), [(6, 79.6), (6, 99.7), (0, 37.1), (3, 78.3), (16, 94.3)])
def test_a_slip_is_named_with_its_line_and_what_would_be_left(i: int, value: float) -> None:
    """The file's line, the value, and chi2 per degree of freedom of a fit without the value."""
    values = noisy()
    values[i] = value
    reason = likeliest_reason(two_pressures(values))
    assert reason and reason.kind == "value"
    assert reason.words.startswith(
        f"t.csv, line {i + 2}: {LABELS[i % 10].display} is {value:g} Hz at"
    )
    rest, both = np.arange(20) != i, np.vstack([J, J])
    d = np.log(values / model_Hz())[rest]
    best = d - both[rest] @ np.linalg.lstsq(both[rest], d, None)[0]
    assert reason.chi2_per_dof == pytest.approx(best @ best / SIGMA**2 / 17)
    unstated = replace(two_pressures(values), is_stated=False)
    again = likeliest_reason(unstated)
    assert again and again.words == reason.words and again.chi2_per_dof is None


@pytest.mark.parametrize(
    ("value", "model", "meant"),
    [
        (317.0, 31.9, 31.7),
        (3.17, 31.9, 31.7),
        (79.6, 97.0, 97.6),
        (97.6, 97.0, None),
        (93.4, 97.0, None),
        (100.0, 10.1, 10.0),
    ],
)
def test_the_likely_value(value: float, model: float, meant: float | None) -> None:
    likely = likely_value(value, model, 0.015)
    assert likely == (meant if meant is None else pytest.approx(meant))


def test_exchanged_pressures_and_labels_are_named() -> None:
    values = noisy()
    pressures = likeliest_reason(two_pressures(np.roll(values, 10)))
    assert pressures and pressures.kind == "exchanged"
    assert "are 200 and 250 kPa exchanged?" in pressures.words
    swapped = values.copy()
    swapped[[2, 5]] = values[[5, 2]]
    labels = likeliest_reason(two_pressures(swapped))
    assert labels and labels.kind == "exchanged"
    assert labels.words.startswith("t.csv, line 4, t.csv, line 7: ")
    assert labels.words.endswith("are the two labels exchanged?")
    assert labels.chi2_per_dof is not None and labels.chi2_per_dof < 2


def test_another_state_is_named_where_it_takes_half_of_chi2_away() -> None:
    """A shift of unknown amount has its likeliest one, a known shift is taken as it is."""
    steep, values = np.r_[np.zeros(10), 0.3 + 0.1 * np.cos(np.arange(10))], noisy()
    words = lambda a: f"{250 * np.exp(a[0]):.0f} kPa?"
    shift = Shift("pressure", steep[:, None], np.zeros(20), words)
    left = two_pressures(values * np.exp(-0.15 * steep))
    reason = likeliest_reason(left, [shift])
    assert reason and reason.kind == "pressure"
    assert float(reason.words.split()[0]) == pytest.approx(250 * np.exp(-0.15), abs=3)
    known = Shift("rim", np.empty((20, 0)), -0.15 * steep, lambda _: "rim?")
    other = likeliest_reason(left, [known])
    assert other and other.words == "rim?"
    assert other.chi2_per_dof == pytest.approx(two_pressures(values).chi2_per_dof)
    assert likeliest_reason(two_pressures(values), [shift, known]) is None


def test_what_the_model_cannot_follow_has_no_reason() -> None:
    """Residuals exceed their scatter in all modes, in none more than in the others."""
    signs = np.resize([1, -1, 1, -1, -1, 1], 20)
    left = two_pressures(model_Hz() * np.exp(0.012 * signs))
    assert left.chi2_per_dof is not None and left.chi2_per_dof > 5
    assert likeliest_reason(left) is None


@pytest.mark.parametrize(("rest", "is_slip"), [(0.0, True), (0.02, False)])
def test_a_slip_is_named_only_if_the_rest_fits(rest: float, is_slip: bool) -> None:
    """[1,0] is off by 10 %; at 2 % of every other value the model lacks more than this row."""
    values = noisy()
    values[2] *= 1.1
    signs = np.resize([1, -1, 1, -1, -1, 1], 20)
    left = two_pressures(values * np.exp(rest * signs))
    reason = likeliest_reason(left)
    assert (reason is not None and reason.kind == "value") == is_slip
    assert left.chi2_per_dof is not None and left.chi2_per_dof > 5


def test_a_slip_is_named_with_one_value_more_than_it_takes() -> None:
    """Four values, two variables, one slip: one degree of freedom is left."""
    values = HERTZ.copy()
    values[1] *= 10
    whole = remainder(values, HERTZ, J, PRESSURES[:1])
    left = Remainder(whole.rows[:4], whole.deviation[:4], whole.covariance[:4, :4], J[:4])
    assert left.freedom == 2
    reason = likeliest_reason(left)
    assert reason and reason.kind == "value" and "did you mean 35 Hz" in reason.words


@pytest.mark.parametrize(("factor", "kind"), [(1.05, "mode"), (10.0, "value")])
def test_a_mode_measured_once_may_show_an_effect(factor: float, kind: str) -> None:
    """Unless its number is a likely slip: at a second pressure the mode would tell."""
    values = noisy()[:10]
    values[4] *= factor
    reason = likeliest_reason(remainder(values, HERTZ, J, PRESSURES[:1]))
    assert reason and reason.kind == kind
    assert reason.excludes_effects == (kind == "value")
    assert ("lack an effect" in reason.words) == (kind == "mode")


@pytest.mark.parametrize(("at_both", "kind"), [(False, "value"), (True, "mode")])
def test_a_mode_that_is_off_at_both_pressures_may_show_an_effect(at_both: bool, kind: str) -> None:
    """[2,0] is 3 % off at one pressure, and right or 1.5 % off at the other."""
    values = noisy()
    values[14] *= 1.03
    values[4] *= 1.015 if at_both else 1.0
    reason = likeliest_reason(two_pressures(values))
    assert reason and reason.kind == kind and "line 16:" in reason.words


def test_a_reason_that_is_nearly_as_likely_is_named_too() -> None:
    """A mode whose sensitivities no other shares is off at one of two pressures: which, nothing
    tells; the reason names one line, and the other."""
    own = np.zeros((20, 1))
    own[[3, 13]] = 1.0
    both = np.hstack([np.vstack([J, J]), own])
    values = noisy()
    values[13] *= 1.06
    left = remainder(values, model_Hz(), both, PRESSURES)
    reason = likeliest_reason(left)
    assert reason and reason.kind == "value"
    lines = {line for line in ("line 5:", "line 15:") if line in reason.sentence}
    assert lines == {"line 5:", "line 15:"}
    assert "Nearly as likely: t.csv, line " in reason.sentence
    clear = values.copy()
    clear[13] /= 1.06
    clear[6] *= 1.06
    alone = likeliest_reason(remainder(clear, model_Hz(), both, PRESSURES))
    assert alone and not alone.also and "Nearly" not in alone.sentence


@pytest.mark.slow
def test_a_default_wheel_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Measured on a freely hanging wheel of 10.5 kg, of which the case says nothing: 15 kg."""
    path = tmp_path / "tyre.yaml"
    shutil.copy(CASES / "p235_75r17.csv", tmp_path)
    text = (CASES / "p235_75r17.yaml").read_text()
    path.write_text(text.replace("known_from: size_code", "known_from: exact"))
    wheel = {"mass_kg": 10.5, "polar_inertia_kg_m2": 0.3, "diametral_inertia_kg_m2": 0.2}
    given = {"rim.free": True} | {f"rim.{name}": value for name, value in wheel.items()}
    table = tmp_path / "m.csv"
    lines = ["pressure_kPa,c,m,kind,rim,frequency_Hz,sigma_Hz"]
    for mode in evaluate_modes(with_values(load_case(path, mesh="coarse"), given)):
        c, m, kind = mode.label.c, mode.label.m, mode.label.kind or ""
        if m <= 1:
            hertz = mode.frequency_Hz
            lines.append(f"240,{c},{m},{kind},free,{hertz:.3f},{0.003 * hertz:.3f}")
    table.write_text("\n".join(lines) + "\n")
    out = tmp_path / "fit"
    words = ["fit", str(path), "--measured", str(table), "--mesh", "coarse", "--no-pictures"]
    words += ["--fix", "A_belt", "--fix", "A_carcass", "--no-store", "--output", str(out)]
    assert run(*words) == 0
    fit = json.loads((out / "fit.json").read_text())
    assert fit["verdict"] == "does_not_fit" and fit["reason"]["kind"] == "wheel"
    likely = re.findall(r"rim\.(\w+) \S+ \(likely (\S+)\)", fit["reason"]["words"])
    assert {name: float(value) for name, value in likely} == pytest.approx(wheel, rel=0.05)
    assert fit["reason"]["chi2_per_dof"] < 5 < fit["chi2_per_dof"]
    assert "what does yours weigh?" in capsys.readouterr().err
