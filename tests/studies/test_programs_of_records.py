"""Programs of studies on record: they find what they import, and count as their page states.

The record of selected numbers is counted as its page states, and a part of it is drawn anew.
The record of what damping tells: sealed, as the page states it, and no loss to frequencies; the
ceiling of its pairs.
The closed form by which a fit's total exceeds the error by the whole covariance.
Slips as the study draws them, and a hundredth of the study itself.
The comparison of one study's answers by two commits.
Stiffnesses of the published sets.
"""

from __future__ import annotations

import ast
import json
import re
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec, resolve_name
from pathlib import Path

import numpy as np
import pytest

from tyrecal.measured.measurement import Measurement
from tyrecal.studies.fit.least_squares import fit_response

from ..chance import generator
from ..conftest import ROOT
from . import sensitivities, slips
from .answered_again import changes
from .damping import WAYS, ceiling, scored, shares
from .fit_errors import LABELS, SIZES, case_of, drawn, table
from .sensitivities import is_right, study
from .slips import DECIMAL, DIGIT, DIGITS, PRESSURES, ROWS, is_named, with_slip
from .standard_errors import compared
from .stiffness import PUBLISHED, SET_B, published

BENCHMARKS = ROOT / "tests" / "benchmarks"
PROGRAMS = sorted(
    path
    for folder in ("studies", "benchmarks", "blind/study3")
    for path in (ROOT / "tests" / folder).glob("[a-z]*.py")
    if not path.name.startswith("test_")
)
OURS = "tyrecal", "tyrecal_solvers", "tests"


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_a_program_finds_the_names_that_it_imports(program: Path) -> None:
    """No test runs most of them: a name that was changed elsewhere would be noticed years later."""
    package = ".".join(program.relative_to(ROOT).parent.parts)
    for node in ast.walk(ast.parse(program.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom):
            continue
        name = resolve_name("." * node.level + (node.module or ""), package)
        if name.partition(".")[0] not in OURS:
            continue
        try:
            module = import_module(name)
        except ModuleNotFoundError as missing:  # a program that tests do without
            assert (missing.name or "").partition(".")[0] not in OURS
            continue
        for alias in node.names:
            assert hasattr(module, alias.name) or find_spec(f"{name}.{alias.name}"), alias.name


def test_what_a_90_percent_interval_holds_is_counted() -> None:
    one = {
        "size": "a",
        "chi2_per_dof": 1.0,
        "variables": {"C10": [3.0, 1.0]},
        "modes": {"[1,0]": 2},
    }
    other = {
        "size": "a",
        "chi2_per_dof": 2.0,
        "variables": {"C10": [-4.0, -1.7]},
        "modes": {"[1,0]": -1},
    }
    rows = list(table([one, other]))
    assert "| a | C10 | 1 of 2 | 3.54 | 1.39 |" in rows
    assert (
        "| a | [1,0] | 1 of 2 |  | 1.58 |" in rows
        and "| a | all modes | 1 of 2 |  | 1.58 |" in rows
    )
    assert rows[-1] == "a: 2 tyres, chi2/dof 1.50 on average"


def test_the_page_states_the_counts_of_stated_errors() -> None:
    page = (BENCHMARKS / "VERDICTS.md").read_text()
    lines = [json.loads(x) for x in (BENCHMARKS / "fit_errors.jsonl").read_text().splitlines()]
    rows = [row.strip("| ").split(" | ")[:3] for row in table(lines) if row[0] == "|"]
    held = {(size, name): count for size, name, count in rows[2:]}
    tyre, prior = "P235/75R17", "P235/75R17, --prior"
    names = ["all modes", "[1,1]", "A_belt", "C10", "A_carcass"]
    counts = [held[prior, name] for name in names]
    unsure = [f"{name}, said not to hold" for name in ("A_belt", "C10", "A_carcass")]
    counts += [held[tyre, name] for name in ("all modes", "[4,0]", "C10", *unsure)]
    for size in ("205/60R15, --prior", "225/45R17, --prior"):
        names = ["all modes", "A_belt", "A_carcass", "C10_sidewall", "C10_tread"]
        counts += [held[size, name] for name in names]
    for count in counts:
        assert count in page, count


LINES = [json.loads(x) for x in (BENCHMARKS / "sensitivities.jsonl").read_text().splitlines()]


def test_the_page_states_the_counts_of_selected_numbers() -> None:
    page = (BENCHMARKS / "VERDICTS.md").read_text()
    rows = list(sensitivities.table(LINES))[2:]
    assert len(rows) == 2 and all(row in page for row in rows)


@pytest.mark.parametrize(
    ("off", "freed", "right"),
    [
        (["a", "b"], [["b"], ["a"]], True),
        (["a", "b"], [["c", "b"], ["a"]], True),
        (["a", "b"], [["a", "b"], ["c"]], False),
        (["a", "b"], [["a"], ["c"], ["b"]], False),
        (["a", "b"], [["a"]], False),
        ([], [], True),
        ([], [["a"]], False),
    ],
)
def test_both_numbers_are_first_or_alike(
    off: list[str], freed: list[list[str]], right: bool
) -> None:
    assert is_right({"off": off, "freed": freed}) == right


@pytest.mark.slow
def test_drawn_tyres_are_those_of_the_record() -> None:
    """The first of the one size: draws and sensitivities are the same on any machine."""
    kept = [line for line in LINES if line["size"] == "P235/75R17" and line["off"]][:4]
    drawn = list(study(4, 7, ["P235/75R17"]))[:4]
    for line, recorded in zip(drawn, kept, strict=True):
        assert line["off"] == recorded["off"]
        assert line["lambda"] == pytest.approx(recorded["lambda"], rel=1e-3)
        assert [group[0] for group in line["freed"]] == [group[0] for group in recorded["freed"]]


def test_the_page_has_the_figures_of_the_sealed_record() -> None:
    """`scored` compares the truth with its seal."""
    page = (BENCHMARKS / "DAMPING.md").read_text(encoding="utf-8")
    given = page.partition("damping_sound.jsonl -->")[2].partition("\n\n")[0]
    rows = [[int(n) for n in re.findall(r"\| (\d+)", line)] for line in given.splitlines()[3:]]
    counts, sound = scored(), scored("damping_sound")
    accused = {way: counts[way]["accused"] + sound[way]["accused"] for way in WAYS}
    kept = "top", "pair", "named", "wrong"
    assert rows == [[*(counts[way][key] for key in kept), accused[way]] for way in WAYS]
    assert counts[WAYS[0]]["sound"] + sound[WAYS[0]]["sound"] == 120
    alone, stated, unknown = (counts[way]["top"] / counts[way]["effects"] for way in WAYS)
    assert stated > alone + 0.05 and unknown >= alone
    assert all(counts[way]["pair"] > 0.9 * counts[way]["effects"] for way in WAYS)


def test_the_page_states_what_a_right_answerer_would_reach() -> None:
    """Right of all pairs as often as the stated probabilities expect, within three standard
    deviations. The record is fixed, so that no chance is in this test."""
    page = (BENCHMARKS / "DAMPING.md").read_text(encoding="utf-8")
    own = shares(WAYS[1])
    mean, error = ceiling(own["temperature"][:, 1])
    others = [ceiling(own[kind][:, 1])[0] for kind in ("spindle", "stiffening", "mass")]
    assert f"{mean:.2f} ± {error:.2f} for temperature" in page and mean + 3 * error < 0.9
    assert f"{min(others):.2f} to {max(others):.2f} for the three others" in page
    size, share = own["temperature"].T
    wrong = share <= 0.5
    least, most = abs(size[wrong]).min(), abs(size[wrong]).max()
    assert wrong.sum() == 6 and f"of {least:.0f} to {most:.0f} K" in page
    assert f"share of {share[wrong].min():.2f} to {share[wrong].max():.2f}" in page
    assert (abs(size) < 7).sum() == 11 and least > 7
    assert f"would make {(share > 1 / 3).sum()} of 30 right" in page  # odds times two
    rival = own.pop("point mass or temperature")[:, 1]
    assert len(rival) == 10 and (rival > 0.5).sum() == 6
    assert f"exceeds {(mean + ceiling(rival)[0]) / 2:.2f}" in page
    every = np.concatenate(list(own.values()))[:, 1]
    larger = np.maximum(every, 1 - every)
    assert abs((every > 0.5).sum() - larger.sum()) < 3 * np.sqrt(larger @ (1 - larger))


@pytest.mark.numbers
def test_published_sets_have_their_ratios_and_check_values() -> None:
    """kN/m of set A over load and pressure; of both sets C_x/C_z, C_y/C_z, and C_psi in Nm/deg."""
    lateral = [published(*at)["lateral_N_per_m"] for at in ((2e3,), (6e3,), (4e3, 198), (4e3, 242))]
    assert np.divide(lateral, 1e3) == pytest.approx([94.3, 111.1, 100.1, 105.2], abs=0.05)
    along = [published(load)["longitudinal_N_per_m"] / 1e3 for load in (2e3, 6e3)]
    assert along == pytest.approx([308.8, 407.3], abs=0.05)
    for known, ratios in ((PUBLISHED, (1.71, 0.49, 84)), (SET_B, (1.82, 0.75, 87))):
        C_z, C_y, C_x, C_psi = published(4e3, 220, known).values()
        assert (C_x / C_z, C_y / C_z) == pytest.approx(ratios[:2], abs=0.005)
        assert C_psi * np.pi / 180 == pytest.approx(ratios[2], abs=0.5)


@pytest.mark.numbers
@pytest.mark.parametrize("correlated", [True, False])
def test_the_total_of_a_fit_exceeds_the_error_by_the_whole_covariance(correlated: bool) -> None:
    """The excess is (R - R') Sigma (R - R')^T, which is 0 if scatter alone is uncertain."""
    random = generator("standard errors", int(correlated))
    J, scatter = random.normal(size=(9, 3)), random.uniform(0.5, 2.0, 9)
    root = random.normal(size=(9, 9)) * correlated
    sigma = np.diag(scatter**2) + root @ root.T
    response, _ = fit_response(J / scatter[:, None], 1 / scatter)  # as the fit weighs
    both = compared(J, scatter, sigma, response @ sigma @ response.T)
    assert both.departure < 1e-9
    total, best = np.diag(both.total), np.diag(both.by_sigma)
    if correlated:
        assert (total > best).all() and (np.linalg.eigvalsh(both.added) > -1e-12).all()
    else:
        np.testing.assert_allclose(total, best)


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


@pytest.mark.numbers
def test_how_the_answers_of_two_commits_differ(tmp_path: Path) -> None:
    """Verdicts, named effects and the largest change of a probability, of the common trials."""
    first = {
        "a": ("named", "e0", {"e0": 0.94, "none": 0.06}),
        "b": ("no_gap", None, {"none": 0.9, "e0": 0.1}),
        "alone": ("no_gap", None, {"none": 0.1, "e0": 0.9}),
    }
    other = {
        "a": ("named", "e1", {"e1": 0.25, "e0": 0.7, "none": 0.05}),
        "b": ("undecided", None, {"none": 0.89, "e0": 0.11}),
    }
    for folder, answers in (("first", first), ("other", other)):
        (tmp_path / folder).mkdir()
        for trial, (verdict, effect, p) in answers.items():
            content = {"diagnosis": {"verdict": verdict, "effect": effect, "probabilities": p}}
            (tmp_path / folder / f"{trial}.json").write_text(json.dumps(content))
    assert changes(tmp_path / "first", tmp_path / "other").splitlines() == [
        "2 trials, 1 other verdicts, 1 other effects,"
        " largest change of a probability 0.250 (e1, a)",
        "b: no_gap, undecided",
        "a: e0, e1",
    ]
    assert "0.250" in changes(tmp_path / "other", tmp_path / "first")


def test_slopes_by_differences_lead_to_the_same_verdicts() -> None:
    lines = [json.loads(x) for x in (BENCHMARKS / "differences.jsonl").read_text().splitlines()]
    assert len({line["trial"] for line in lines}) == 40
    assert all(line["exact"] == line["differences"] for line in lines)
    assert max(line["off"] for line in lines) <= 0.05
