"""The measurement worth making next: what each would add to telling the explanations apart.

Gain of a choice: the rise of sum over explanations i, j of p_i p_j min(delta_ij^2, 40) for an hour
of work, where delta_ij^2 = |P^1/2 (g_i - g_j)|^2, "none" having g = 0. (A distance beyond 40 is as
good as certain.)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...simulate.modes.label import Label
from .covariance import covariance
from .evidence import NONE, OUTSIDE
from .expansion import Nodes
from .inverse_problem import InverseProblem, Toggle
from .model import Answer, ModelRow, Query, ResponseModel
from .observations import Observable, Observations
from .section_fields import SECTION

Array = np.ndarray
MAX_DISTANCE = 40.0
MIN_PROBABILITY, MAX_EXPLANATIONS = 0.02, 6  # others do not count
HOURS = dict(cut=8.0, toggle=4.0, check=1.0, repeat=2.0, pressure=1.0, harmonics=1.0, weigh=0.25)
"""Of a laboratory, as an orientation."""
CHECKED = 0.25  # what is left of a constant's standard deviation when it is measured by itself
REPEATED = 4  # times, each after dismounting
OFFERED_kPa = (160.0, 200.0, 240.0, 280.0, 320.0)
FAR_kPa = 60.0  # from every pressure measured so far, for a new one to be offered
MASS_PERCENT = 0.5


@dataclass(frozen=True)
class Choice:
    """A measurement that could be made."""

    what: str
    hours: float  # an orientation
    gain: float  # per hour


@dataclass(frozen=True)
class _Look:
    """What a set of rows shows."""

    sigma: Array  # (n, n)
    jacobian: Array  # (n, v)
    shifts: Mapping[str, Array]  # (n,) of each explanation

    def apart(self, likely: Mapping[str, float], spread: Array) -> float:
        """sum over i, j of p_i p_j min(delta_ij^2, 40)."""
        inverse = np.linalg.inv(self.sigma)
        J = self.jacobian
        inner = np.linalg.solve(J.T @ inverse @ J + np.diag(spread**-2.0), J.T @ inverse)
        P = inverse - inverse @ J @ inner
        keys, total = list(likely), 0.0
        for i, a in enumerate(keys):
            for b in keys[:i]:
                off = self.shifts[a] - self.shifts[b]
                total += 2 * likely[a] * likely[b] * min(float(off @ P @ off), MAX_DISTANCE)
        return total


def rank(
    problem: InverseProblem,
    d: Array,
    probabilities: Mapping[str, float],
    sizes: Mapping[str, Mapping[str, float]],
    sources: Sequence[str],
    further: Callable[[list[ModelRow]], ResponseModel] | None = None,
) -> list[Choice]:
    """The menu by falling gain, at the plain fit x0 + d.

    sizes: parameters by explanation and id; sources: names of the sources of error; further: a
    model of other rows of the same tyre. Empty where one explanation stands alone.
    """
    likely = {
        key: p
        for key, p in probabilities.items()
        if p > MIN_PROBABILITY and key != OUTSIDE and (key == NONE or key in sizes)
    }
    likely = dict(sorted(likely.items(), key=lambda item: -item[1])[:MAX_EXPLANATIONS])
    if len(likely) < 2:
        return []
    now = _look(problem, d, likely, sizes)
    before = now.apart(likely, problem.spread)
    menu: list[tuple[str, float, InverseProblem]] = []
    of_section = {k: CHECKED for k, name in enumerate(sources) if name.startswith(SECTION)}
    if of_section:
        known = replace(problem, reduced={**problem.reduced, **of_section})
        menu.append(("cut the tyre and measure its section", HOURS["cut"], known))
    for k, source in enumerate(sources):
        if k in of_section:
            continue
        known = replace(problem, reduced={**problem.reduced, k: CHECKED})
        menu.append((f"measure by itself: {source.replace('_', ' ')}", HOURS["check"], known))
    o, factor = problem.observations, 1 / np.sqrt(REPEATED)
    finer = replace(o, scatter=o.scatter * factor, common=o.common * factor)
    words = f"measure all {REPEATED} times, dismounted in between"
    repeated = replace(problem, observations=finer)
    menu.append((words, HOURS["repeat"] * (REPEATED - 1), repeated))
    for id in dict.fromkeys(id for key in likely if key != NONE for id in sizes[key]):
        span = problem.spans.get(id)
        words = (span.toggle if span else "") or f"measure again without {id}"
        menu.append((words, HOURS["toggle"], _switched(problem, id)))
    offered = [(words, hours, _look(other, d, likely, sizes)) for words, hours, other in menu]
    if further:
        offered += _more_rows(problem, now, likely, sizes, further)
    choices = [
        Choice(what, hours, (look.apart(likely, problem.spread) - before) / hours)
        for what, hours, look in offered
    ]
    return sorted(choices, key=lambda choice: -choice.gain)


def _look(
    problem: InverseProblem,
    d: Array,
    likely: Mapping[str, float],
    sizes: Mapping[str, Mapping[str, float]],
) -> _Look:
    shifts = {
        key: problem.added({id: np.array([e]) for id, e in sizes.get(key, {}).items()}, 1)[0][0]
        for key in likely
    }
    return _Look(problem.sigma, problem.plain(d)[1], shifts)


def _switched(problem: InverseProblem, id: str) -> InverseProblem:
    """The problem with one run more, in which the effect is absent."""
    run = 1 + len(problem.changes)
    first = np.array([row.run == 0 for row in problem.observations.rows])
    o = problem.observations
    join = lambda values: np.concatenate([values, values[first]])
    rows = (*o.rows, *(replace(row, run=run) for row in o.only(first).rows))
    numbers = (join(o.y), join(o.scatter), o.common, join(o.split), join(o.split_scatter))
    both = Observations(rows, *numbers)
    base = problem.spans[id].base if id in problem.spans else 0.0
    changes = (*problem.changes, Toggle(id, 0.0, base=base))
    return replace(problem, observations=both, places=join(problem.places), changes=changes)


def _along(nodes: Nodes, e: float, slope: Array) -> Array:
    """What an effect of parameter e adds to further rows (m,), whose slopes by it are known at 0:
    they bend as those that it was asked for do, on the whole; 0 where there is no slope."""
    line, bent = nodes.slope[nodes.values == 0][0] * e, nodes.shift_at(np.array([e]))[0]
    known = np.isfinite(line)
    share = bent[known] @ line[known] / (line[known] @ line[known]) if line[known].any() else 1.0
    return np.nan_to_num(slope) * e * share


def _more_rows(
    problem: InverseProblem,
    now: _Look,
    likely: Mapping[str, float],
    sizes: Mapping[str, Mapping[str, float]],
    further: Callable[[list[ModelRow]], ResponseModel],
) -> list[tuple[str, float, _Look]]:
    """Other pressures, higher harmonics and the mass, as far as the model has an answer."""
    o = problem.observations
    labels = sorted({row.label for row in o.rows if row.label}, key=str)
    pressures = sorted({row.pressure_kPa for row in o.rows if row.label})
    offered: list[tuple[str, float, list[ModelRow]]] = []
    for p in OFFERED_kPa:
        if all(abs(p - q) >= FAR_kPa for q in pressures):
            more: list[ModelRow] = [(label, p) for label in labels]
            offered.append((f"measure the same modes at {p:g} kPa", HOURS["pressure"], more))
    top = max(label.c for label in labels)
    higher = [Label(top + 1, 0), Label(top + 1, 1)]
    measured_in = dict.fromkeys(row.row[1] for row in o.rows if row.label)
    more = [(label, where) for label in higher for where in measured_in]
    offered.append((f"measure {higher[0]} and {higher[1]}, too", HOURS["harmonics"], more))
    if all(row.label for row in o.rows):
        offered.append(("weigh the tyre", HOURS["weigh"], [(None, 0.0)]))
    rows = list(dict.fromkeys(row for _, _, more in offered for row in more))
    model = further(rows)
    x0 = problem.expansion.x0
    effects = [sizes.get(key, {}) for key in likely]
    lines = tuple({id: 0.0 for each in effects for id in each if id in model.sloped_at_0})
    points = [Query(x0, constants=True, slopes=lines)]
    points += [Query(x0, {id: e for id, e in each.items() if id not in lines}) for each in effects]
    answers = model.answers(points)
    if not all(isinstance(answer, Answer) for answer in answers):
        return []
    plain, *others = [answer for answer in answers if isinstance(answer, Answer)]
    assert plain.constants is not None
    added = {
        key: sum(
            (
                _along(problem.expansion.nodes[id], each[id], plain.slopes[id])
                for id in lines
                if id in each
            ),
            other.eta - plain.eta,
        )
        for key, each, other in zip(likely, effects, others, strict=True)
    }
    scatter = float(np.median(o.scatter))
    result = []
    for words, hours, more in offered:
        at = [rows.index(row) for row in more]
        new = tuple(map(Observable.of, more))
        size = np.array([scatter if label else MASS_PERCENT / 100 for label, _ in more])
        none, join = np.full(len(more), np.nan), lambda *parts: np.concatenate(parts)
        both = Observations(
            (*o.rows, *new),
            join(o.y, plain.eta[at]),
            join(o.scatter, size),
            o.common,
            join(o.split, none),
            join(o.split_scatter, none),
        )
        constants = np.vstack([problem.constants, plain.constants[at]])
        shifts = {key: np.concatenate([now.shifts[key], added[key][at]]) for key in likely}
        jacobian = np.vstack([now.jacobian, plain.jacobian[at]])
        sigma = covariance(both, constants, problem.assumed.form)
        result.append((words, hours, _Look(sigma, jacobian, shifts)))
    return result
