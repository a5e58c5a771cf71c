"""Frequencies without labels: the probability of every labeling, and a fit with the likeliest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from tyrecal.errors import InputError
from tyrecal.measured.measurement import Measurement, measurements_csv
from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.study import FitStudy
from tyrecal.studies.labelling.expansion import ModesNearDesign, Prior, find_labels
from tyrecal.studies.labelling.label import Labelled, fitted_prior, label, start_prior
from tyrecal.studies.labelling.result import labels_posterior
from tyrecal.studies.labelling.tree import (
    DISCREPANCIES,
    FOREIGN,
    FOREIGN_MARGIN,
    MISSED,
    SECOND,
    SPLIT,
    UNSEEN,
    VIEWS,
    Frequencies,
    Modes,
    discrepancy,
    labelings,
)
from tyrecal.studies.labels import FOREIGN_WORDS
from tyrecal.tyre.state import TyreState

from ..chance import generator
from ..solved import calibrate
from .tyre_in_states import CASE, TRUTH, TyreInStates, case_with, measured

Array = np.ndarray
OWN = (Label(1, 0), Label(1, 1), Label(2, 0), Label(2, 1))


def every_labeling(
    given: Frequencies, modes: Modes, tau: float
) -> Iterator[tuple[Any, float, float]]:
    """List each admissible labeling with ln of prior times evidence, and ln of the evidence of
    its labelled frequencies, from the joint normal density. With shapes, mode n + k is the second
    of the pair k."""
    (count, base), shapes = given.allowed.shape, given.ln_shape
    mode_of = [*range(base), *range(base if shapes is not None else 0)]  # all of `OWN` are pairs
    shapes = np.zeros((count, base)) if shapes is None else shapes
    n = len(mode_of)
    labels = [modes.labels[j] for j in mode_of]
    C = (modes.H @ modes.H.T + discrepancy(modes.labels, tau))[np.ix_(mode_of, mode_of)]
    mu, split = modes.mu[mode_of], np.where(np.arange(n) < base, 0.0, SPLIT)
    width = np.ptp(given.y) + 2 * FOREIGN_MARGIN
    for own in product(range(-1, n), repeat=count):
        used = [j for j in own if j >= 0]
        fits = all(
            given.allowed[i, mode_of[j]] if j >= 0 else not given.sure[i] for i, j in enumerate(own)
        )
        in_order = all(j < base or j - base in own[:i] for i, j in enumerate(own))
        if len({*used}) < len(used) or not fits or not in_order:
            continue
        rows = [i for i, j in enumerate(own) if j >= 0]
        S = C[np.ix_(used, used)] + np.diag(given.s[rows] ** 2 + split[used] ** 2)
        off, gain = given.y[rows] - mu[used], np.linalg.solve(S, C[used]).T
        of_labelled = float(multivariate_normal.logpdf(off, None, S)) if used else 0.0
        ln = of_labelled + (count - len(used)) * np.log(FOREIGN / width)
        ln += sum(shapes[i, mode_of[j]] for i, j in enumerate(own) if j >= 0)
        mean, P = mu + gain @ off, C - gain @ C[used]
        within = norm.cdf((given.y.max() - mean) / np.sqrt(np.diag(P)))
        views = []
        for sees, p in VIEWS.items():
            seen = [1 - MISSED if sees[each.m] else UNSEEN for each in labels[:base]]
            lost = [MISSED if sees[each.m] else 1 - UNSEEN for each in labels[:base]]
            seen, lost = seen + [SECOND] * base, lost + [1 - SECOND] * base
            terms = [
                np.log(seen[j]) if j in used else np.log(1 - within[j] * (1 - lost[j]))
                for j in range(n)
                if j < base or j - base in used
            ]
            views.append(np.log(p) + sum(terms))
        labeling = tuple(mode_of[j] if j >= 0 else -1 for j in own)
        yield labeling, float(ln + np.logaddexp.reduce(views)), of_labelled


def exact_sums(given: Frequencies, modes: Modes) -> tuple[dict[Any, float], dict[Any, float]]:
    """Prior times evidence of every labeling, and the evidence of its labelled frequencies, over
    all discrepancies."""
    total: dict[Any, float] = {}
    evidence: dict[Any, float] = {}
    for tau in DISCREPANCIES:
        for own, ln, of_labelled in every_labeling(given, modes, tau):
            total[own] = total.get(own, 0.0) + np.exp(ln)
            evidence[own] = evidence.get(own, 0.0) + np.exp(of_labelled)
    return total, evidence


@pytest.mark.numbers
def test_every_labeling_has_the_probability_of_its_joint_density() -> None:
    """Three frequencies, one of a known mode, another that can be two: against all labelings."""
    random = generator("unlabelled")
    modes = Modes(OWN, np.zeros(4, int), np.log([50, 52, 70, 75]), 0.1 * random.normal(size=(4, 2)))
    allowed = np.ones((3, 4), bool)
    allowed[1] = [True, True, False, False]
    allowed[2] = [False, False, False, True]
    y = np.log([51.0, 54.0, 74.0])
    given = Frequencies(y, np.full(3, 0.01), np.zeros(3, int), allowed, np.array([0, 0, 1], bool))
    result = labelings(given, modes)
    total, evidence = exact_sums(given, modes)
    whole = sum(total.values())
    by_modes = dict(zip(map(tuple, result.modes.tolist()), result.probabilities, strict=True))
    assert len(total) == 10
    for own, value in total.items():
        assert by_modes.get(own, 0.0) == pytest.approx(value / whole, rel=1e-6, abs=1e-8)
    assert result.each.sum(1) == pytest.approx(1.0)
    for own, ln_prior in zip(map(tuple, result.modes[:3].tolist()), result.ln_prior, strict=False):
        assert ln_prior == pytest.approx(np.log(total[own] / evidence[own]), abs=1e-6)
    anew = result.with_probabilities(np.array([0.2, 0.8]))
    first = result.probabilities[:2].sum()
    expected = [0.2 * first, 0.8 * first, *result.probabilities[2:]]
    assert anew.probabilities == pytest.approx(np.sort(expected)[::-1])
    shares = dict(zip(map(tuple, anew.modes.tolist()), anew.probabilities, strict=True))
    assert [shares[tuple(own)] for own in result.modes.tolist()] == pytest.approx(expected)
    assert anew.each.sum(1) == pytest.approx(1.0)
    for i, j in ((0, 1), (1, -1), (2, 3)):
        share = sum(p for own, p in by_modes.items() if own[i] == j)
        assert result.each[i, j] == pytest.approx(share)


@pytest.mark.numbers
def test_shapes_count_in_the_same_probability() -> None:
    """Three frequencies with shapes, two of them of one pair: against all labelings. What a
    diagnosis weighs with its own evidence of the frequencies contains the shapes."""
    random = generator("shapes")
    modes = Modes(OWN, np.zeros(4, int), np.log([50, 52, 70, 75]), 0.1 * random.normal(size=(4, 2)))
    every, none = np.ones((3, 4), bool), np.zeros(3, bool)
    y, s = np.log([51.0, 51.3, 74.0]), np.full(3, 0.01)
    ln_shape = random.normal(size=(3, 4)) + np.array([[3.0, 0, 0, 0], [3.0, 0, 0, 0], [0] * 4])
    given = Frequencies(y, s, np.zeros(3, int), every, none, ln_shape)
    result = labelings(given, modes)
    total, evidence = exact_sums(given, modes)
    assert tuple(result.modes[0, :2]) == (0, 0)
    by_modes = dict(zip(map(tuple, result.modes.tolist()), result.probabilities, strict=True))
    for own, value in total.items():
        share = value / sum(total.values())
        assert by_modes.get(own, 0.0) == pytest.approx(share, rel=1e-6, abs=1e-8)
    for own, ln_prior in zip(map(tuple, result.modes[:3].tolist()), result.ln_prior, strict=False):
        assert ln_prior == pytest.approx(np.log(total[own] / evidence[own]), abs=1e-6)


@pytest.mark.numbers
def test_expansions_go_on_until_the_design_is_found() -> None:
    """ln f curves with x: the labels are those about the design that the frequencies lead to, past
    a first step to one that has no solution."""
    labels = tuple(Label(c, 0) for c in range(1, 6))
    base, slope = np.log([40.0, 50.0, 62.0, 76.0, 92.0]), np.array([1.0, 0.7, 0.4, 0.3, 0.2])

    def ln_f(x: Array) -> Array:
        return np.asarray(base + slope * (x + 0.3 * x**2))

    failed, limit = list[Array](), 0.92

    def expand(x: Array) -> ModesNearDesign:
        if x[0] > limit:
            failed.append(x)
            raise EvaluationFailed("unstable", "no solution")
        return ModesNearDesign(labels, np.zeros(5, int), ln_f(x), (slope * (1 + 0.6 * x))[:, None])

    y = ln_f(np.array([0.9]))

    def given(at: ModesNearDesign) -> Frequencies:
        every = np.ones((5, 5), bool)
        return Frequencies(y, np.full(5, 0.005), np.zeros(5, int), every, np.zeros(5, bool))

    prior = Prior(np.zeros(1), np.array([[0.5]]), np.array([-2.0]), np.array([2.0]))
    search = find_labels(expand, given, prior)
    assert search.settled and search.labels() == list(labels)
    assert search.x == pytest.approx(0.9, abs=0.02) and failed
    limit = 0.01
    search = find_labels(expand, given, prior)
    assert not search.settled and search.x == 0.0 and search.rounds == 1


STATES = [TyreState(), TyreState(160.0, 0.0, "free")]
FOREIGN_Hz = 90.0


class Tyre(TyreInStates):
    """Toy tyre with an evaluator's way to other designs of the same tyre."""

    def of(self, design: Any) -> Tyre:
        return self


def with_labels() -> list[Measurement]:
    """The nine modes of TRUTH in two states, less two."""
    rows = [
        Measurement(
            "frequency_Hz",
            Label(t.c, t.m, t.kind),
            "",
            t.pressure_kPa or 240.0,
            0.0,
            t.frequency_Hz,
            0.2,
            rim=t.rim,
        )
        for t in measured(STATES)
    ]
    return [each for i, each in enumerate(rows) if i not in (3, 12)]


def without_labels() -> list[Measurement]:
    """The same without labels, but for the first one's, and a frequency that is no mode."""
    first, *rest = with_labels()
    foreign = replace(first, value=FOREIGN_Hz, label=None)
    return [first, *(replace(each, label=None) for each in rest), foreign]


@pytest.fixture(scope="module")
def labelled() -> Labelled:
    tyre: Any = Tyre()
    return label(case_with([]), tyre, without_labels())


@pytest.mark.numbers
def test_readings_get_the_labels_of_the_tyre(labelled: Labelled) -> None:
    """Readings of two states are labelled together; the one that is no mode is left out and
    reported."""
    assert labelled.readings == with_labels()
    left = [own for own, x in zip(labelled.frequencies, labelled.labels, strict=True) if x is None]
    assert [each.value for (each,) in left] == [FOREIGN_Hz]
    second = [label for label in labelled.found.labels(1) if label]
    in_order = sorted(labelled.under(1), key=lambda each: each.value)
    assert [each.label for each in in_order] == second != [x for x in labelled.labels if x]
    assert labelled.found.settled
    labels = labels_posterior(CASE, labelled)
    assert len(labels.frequencies) == 16 and not labels.doubts()
    (foreign,) = [each for each in labels.frequencies if each.label is None]
    assert foreign.frequency_Hz == FOREIGN_Hz and foreign.display == FOREIGN_WORDS
    for each in labels.frequencies:
        rest = 1 - each.probability - sum(rival.probability for rival in each.rivals)
        assert -1e-9 < rest < 0.05
    assert labels.labelings[0].labels == [each.display for each in labels.frequencies]


@pytest.mark.numbers
def test_a_fit_takes_the_likeliest_labels_and_tells_them(tmp_path: Path) -> None:
    tyre: Any = Tyre()
    path = tmp_path / "unlabelled.csv"
    path.write_text(measurements_csv(without_labels()))
    study = FitStudy(CASE, tyre, path)
    assert study.needs_labels and not study.evaluates_one_by_one and not tyre.asked
    fit = study.run()
    modes = {(t.c, t.m, t.kind, t.pressure_kPa, t.rim) for t in study.case.case.targets.modes}
    known = [(each.label, each.state.of(CASE)) for each in with_labels() if each.label]
    assert modes == {(x.c, x.m, x.kind, state.pressure_kPa, state.rim) for x, state in known}
    for name, truth in TRUTH.items():
        assert fit.result["variables"][name]["value"] == pytest.approx(truth, rel=1e-3)
    assert fit.result["labels"]["settled"] and len(fit.result["labels"]["frequencies"]) == 16
    assert "Labels of frequencies without a label" in [t.title for t in fit.found.tables()]


def test_what_a_fit_leaves_open_is_the_prior_of_the_next() -> None:
    """The prior has the fit's standard errors and correlations, and is no wider than before."""
    tyre: Any = Tyre()
    case = case_with(measured(STATES))
    fit = calibrate(case, tyre).found
    prior = fitted_prior(case, fit)
    covariance = prior.root @ prior.root.T
    for i, (name, v) in enumerate(fit.variables.items()):
        assert np.exp(prior.mean[i]) == pytest.approx(v.value)
        assert np.sqrt(covariance[i, i]) == pytest.approx(v.standard_error / v.value)  # type: ignore[operator]
        other = list(fit.variables)[i - 1]
        alike = covariance[i, i - 1] / np.sqrt(covariance[i, i] * covariance[i - 1, i - 1])
        assert alike == pytest.approx(fit.correlations[name][other], abs=1e-9)
    unseen = fit.variables["C10"].model_copy(update={"standard_error": None})
    open_ = fit.model_copy(update={"variables": {**fit.variables, "C10": unseen}})
    wide = start_prior(Problem(case, tyre).variables)
    root = fitted_prior(case, open_).root
    assert (root @ root.T)[2, 2] == pytest.approx(wide.root[2, 2] ** 2)


def test_files_without_labels(tmp_path: Path) -> None:
    """Cells or columns of c and m may be empty where labels are looked for, not elsewhere, nor
    under load; the CSV that is written reads back."""
    path = tmp_path / "measured.csv"
    path.write_text("frequency_Hz,sigma_Hz,pressure_kPa,rim\n114,0.5,160,free\n137,0.5,160,free\n")
    rows = read_measurements(path, labelled=False)
    assert [(each.value, each.label, each.rim) for each in rows] == [
        (114.0, None, "free"),
        (137.0, None, "free"),
    ]
    with pytest.raises(InputError, match="line 2: the frequency has no label, c and m"):
        read_measurements(path)
    again = tmp_path / "again.csv"
    again.write_text(measurements_csv(without_labels()))
    back = [(each.label, each.value) for each in read_measurements(again, labelled=False)]
    assert back == [(each.label, pytest.approx(each.value, rel=1e-5)) for each in without_labels()]
    path.write_text("frequency_Hz,sigma_Hz,pressure_kPa,load_N\n114,0.5,160,4000\n")
    with pytest.raises(InputError, match="line 2: c is '', must be a whole number under load"):
        read_measurements(path, labelled=False)
