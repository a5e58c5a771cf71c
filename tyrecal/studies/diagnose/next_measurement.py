"""The measurement worth making next: how much each is expected to show about which explanation
holds.

Gain of a choice: information for an hour of work. With the x of the fit integrated out, data that
are there (1) and further ones (2) are jointly normal, in

    S = Sigma + J Sx^2 J^T,   C = S_22 - S_21 S_11^-1 S_12,   u = C^-1/2 (g_2 - S_21 S_11^-1 g_1)

where g is what an explanation of some size adds: further data are N(u, I), whatever the known ones
are. Their information on the explanation is that on explanation and size, less that on the size of
a known one, each by its lower bound of Kolchinsky and Tracey (Entropy 19 (2017) 361), exact for
what is alike and for what is far apart:

    I = -sum_a w_a ln (sum_b w_b exp(-|u_a - u_b|^2 / 8))
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...simulate.modes.label import Label
from ..inference.compressed_cords import COMPRESSION
from ..inference.expansion import EffectResponse
from ..inference.inverse_problem import InverseProblem, Toggle
from ..inference.model import Answer, ModelRow, Query, ResponseModel
from ..inference.observations import Observable, Observations
from ..inference.section_fields import SECTION
from .evidence import NONE, OUTSIDE

Array = np.ndarray
Sizes = Mapping[str, Array]  # equally probable parameters (q,) of an explanation's effects, by id
MIN_PROBABILITY, MAX_EXPLANATIONS = 0.005, 10  # others do not count
MAX_EVALUATED = 4  # explanations whose further rows need runs of the solver; others do not count
SIZES = 7  # of each explanation
STEP_HOURS = dict(
    mount=2.0,  # take the tyre off its rim and put it on again
    pressure=0.25,  # set a pressure and let the tyre settle
    frf_set=0.75,  # measure the response functions of all sensors
    change=1.0,  # switch an effect on or off
    check=1.0,  # measure a number of the section or of a compound
    weigh=0.1,
    gauge=0.1,  # compare the pressure gauge with a second one
    thermometer=0.1,
    rim=0.2,
    seat=0.2,
    calliper=0.5,
    cut=8.0,
)
"""Hours of each step in a laboratory: assumptions."""


def cost_hours(steps: Mapping[str, float]) -> dict[str, float]:
    """Hours of each measurement, from those of its steps."""
    one_set = steps["pressure"] + steps["frf_set"]
    tools = ("weigh", "gauge", "thermometer", "rim", "seat", "calliper", "cut", "check")
    sets = dict.fromkeys(("pressure", "helium", "harmonics"), one_set)
    mounted = dict.fromkeys(("mount", "clamp"), steps["mount"] + one_set)
    return {
        **{tool: steps[tool] for tool in tools},
        **sets,
        **mounted,
        "toggle": steps["mount"] + steps["change"] + one_set,
    }


COST_HOURS = cost_hours(STEP_HOURS)
DIRECT_READINGS = {
    "rim": ("measure the rim between its flanges", {"rim_width"}),
    "seat": ("check that the moulded line runs level with the rim flange", {"bead_seat"}),
    "calliper": ("check gauges and widths with a calliper", {"tread_wear", "sidewall_gauge"}),
    "cut": (
        "cut the tyre and measure its section",
        {
            "bead_filler",
            "cap_ply",
            "belt_angle",
            "belt_width",
            "carcass_fanning",
            "carcass_turn_up",
        },
    ),
}
"""What shows the size of which effects itself."""
HELD_BY = {  # effects that a rigid clamp is without
    "spindle_lateral",
    "spindle_radial",
    "spindle_torsional",
    "spindle_tilt",
    "wheel_free",
}
CAVITY_GAS, HELIUM = "cavity_air", 0.14  # a seventh of the mass
READING = 0.1  # of an effect's range, by which such a reading may be off
CHECKED = 0.25  # of a constant's standard deviation, likewise
OFFERED = (0.4, 2 / 3, 5 / 6, 1.0)  # pressures over the tyre's inflation pressure
ABOVE_kPa = (40.0, 80.0)  # more than the inflation pressure, offered too: any tyre bears that
# distance of an offered pressure from all that were measured, over the inflation pressure
MIN_OFFERED_STEP = 0.25
MASS_PERCENT = 0.5  # standard deviation of weighing a tyre


@dataclass(frozen=True)
class Choice:
    """A measurement that could be made."""

    what: str
    hours: float  # an orientation
    gain: float  # information in nats per hour


@dataclass(frozen=True)
class OtherStates:
    """The same tyre in states that were not measured."""

    model: Callable[[list[ModelRow]], ResponseModel]  # of other rows
    inflation_kPa: float  # the tyre's own


def offered_kPa(inflation_kPa: float, measured: Sequence[float]) -> list[float]:
    """Pressures that may be measured in addition to these."""
    there = [float(round(share * inflation_kPa, -1)) for share in OFFERED]
    there += [inflation_kPa + more for more in ABOVE_kPa]
    return [
        p
        for p in there
        if all(abs(p - each) >= MIN_OFFERED_STEP * inflation_kPa for each in measured)
    ]


@dataclass(frozen=True)
class CandidateRows:
    """Rows of a measurement, those that are there first, and what they show."""

    sigma: Array  # (n, n)
    jacobian: Array  # (n, v)
    shifts: Mapping[str, Array]  # (q, n) of each explanation at its sizes

    def information(self, known: int, likely: Mapping[str, float], spread: Array) -> float:
        """Information in the rows after the ``known`` ones, in nats; spread (v,): of x."""
        S = self.sigma + (self.jacobian * spread**2) @ self.jacobian.T
        foretold = np.linalg.solve(S[:known, :known], S[:known, known:])
        root = np.linalg.cholesky(S[known:, known:] - S[known:, :known] @ foretold)
        g = np.vstack([self.shifts[key] for key in likely])
        u = np.linalg.solve(root, (g[:, known:] - g[:, :known] @ foretold).T).T
        count = [len(self.shifts[key]) for key in likely]
        own = np.repeat(np.arange(len(count)), count)
        p = np.array(list(likely.values())) / sum(likely.values())
        w = (p / count)[own]
        alike = np.exp(-((u[:, None] - u) ** 2).sum(2) / 8)
        within = (alike * (own[:, None] == own)) @ w / p[own]
        return float(w @ np.log(within / (alike @ w)))


def rank(
    problem: InverseProblem,
    d: Array,
    probabilities: Mapping[str, float],
    sizes: Mapping[str, Sizes],
    sources: Sequence[str],
    further: OtherStates | None = None,
) -> list[Choice]:
    """The menu by falling gain, at the plain fit x0 + d.

    sizes: by explanation; sources: names of the sources of error. Empty where one explanation
    stands alone.
    """
    likely = {
        key: p
        for key, p in probabilities.items()
        if p > MIN_PROBABILITY and key != OUTSIDE and (key == NONE or key in sizes)
    }
    likely = dict(sorted(likely.items(), key=lambda item: -item[1])[:MAX_EXPLANATIONS])
    if len(likely) < 2:
        return []
    problem = replace(problem, zeta=0.0)
    of = {key: sizes.get(key, {}) for key in likely}
    now = rows_shown(problem, d, of)
    offered: list[tuple[str, float, CandidateRows]] = []
    of_section = [k for k, name in enumerate(sources) if name.startswith(SECTION)]
    for k, source in enumerate(sources):
        if not source.startswith((SECTION, COMPRESSION)):
            words = f"measure separately: {source.replace('_', ' ')}"
            offered.append((words, COST_HOURS["check"], with_readings(problem, now, of, [], [k])))
    ids = list(dict.fromkeys(id for each in of.values() for id in each))
    for tool, (words, shown) in DIRECT_READINGS.items():
        here, known = [id for id in ids if id in shown], of_section if tool == "cut" else []
        if here or known:
            offered.append((words, COST_HOURS[tool], with_readings(problem, now, of, here, known)))
    words = "dismount the tyre, mount it again and repeat all measurements"
    offered.append((words, COST_HOURS["mount"], again(problem, now, d, of)))
    if clamped := [id for id in ids if id in HELD_BY]:
        words = "clamp the rim rigidly in place of the spindle and measure again"
        changes = [_absent(problem, id) for id in clamped]
        offered.append((words, COST_HOURS["clamp"], again(problem, now, d, of, changes)))
    every = HELD_BY.union(*(shown for _, shown in DIRECT_READINGS.values()))
    for id in (id for id in ids if id not in every):
        change, tool = _absent(problem, id), "toggle"
        toggle = problem.ranges[id].toggle if id in problem.ranges else ""
        words = toggle or f"measure again without {id}"
        if id == CAVITY_GAS:
            words, tool = "inflate with helium and measure again", "helium"
            change = replace(change, value=HELIUM, times=True)
        offered.append((words, COST_HOURS[tool], again(problem, now, d, of, [change])))
    if further:
        offered += _more_rows(problem, now, d, of, further)
    there = len(now.sigma)
    choices = [
        Choice(what, hours, after.information(there, _among(likely, after), problem.spread) / hours)
        for what, hours, after in offered
    ]
    return sorted(choices, key=lambda choice: -choice.gain)


def _among(likely: Mapping[str, float], after: CandidateRows) -> dict[str, float]:
    """Probabilities of the explanations whose shifts of the rows are known."""
    return {key: p for key, p in likely.items() if key in after.shifts}


def _absent(problem: InverseProblem, id: str) -> Toggle:
    return Toggle(id, 0.0, base=problem.ranges[id].base if id in problem.ranges else 0.0)


def rows_shown(problem: InverseProblem, d: Array, sizes: Mapping[str, Sizes]) -> CandidateRows:
    """The measured rows as candidates."""
    shifts = {key: _shifts(problem, each, d) for key, each in sizes.items()}
    return CandidateRows(problem.sigma, problem.plain(d)[1], shifts)


def _shifts(problem: InverseProblem, sizes: Sizes, d: Array) -> Array:
    """Shift (q, n) that an explanation adds at x0 + d."""
    added = problem.added(sizes, _count(sizes))
    return np.asarray(added.shift + added.tilt @ d)


def _count(sizes: Sizes) -> int:
    return max((len(each) for each in sizes.values()), default=1)


def with_readings(
    problem: InverseProblem,
    now: CandidateRows,
    sizes: Mapping[str, Sizes],
    ids: Sequence[str],
    sources: Sequence[int],
) -> CandidateRows:
    """The rows with readings of effects' sizes, over their ranges, and of sources of error
    themselves."""
    n, m = len(now.sigma), len(ids) + len(sources)
    ranges = [problem.ranges[id] for id in ids]
    far = [max(abs(span.low), abs(span.high)) for span in ranges]
    sigma = np.zeros((n + m, n + m))
    sigma[:n, :n] = now.sigma
    sigma[:n, n + len(ids) :] = problem.constants[:, list(sources)]
    sigma[n + len(ids) :, :n] = sigma[:n, n + len(ids) :].T
    own = [READING**2 + (span.prior_sd / end) ** 2 for span, end in zip(ranges, far, strict=True)]
    sigma[range(n, n + m), range(n, n + m)] = own + [1 + CHECKED**2] * len(sources)
    shifts = {}
    for key, each in sizes.items():
        more = np.zeros((_count(each), m))
        for i, (id, end) in enumerate(zip(ids, far, strict=True)):
            more[:, i] = each.get(id, 0.0) / end
        shifts[key] = np.hstack([now.shifts[key], more])
    return CandidateRows(
        sigma, np.vstack([now.jacobian, np.zeros((m, len(problem.centre)))]), shifts
    )


def again(
    problem: InverseProblem,
    now: CandidateRows,
    d: Array,
    sizes: Mapping[str, Sizes],
    changes: Sequence[Toggle] = (),
) -> CandidateRows:
    """The rows with one run more, in which something was switched."""
    o, run = problem.observations, 1 + max(row.run for row in problem.observations.rows)
    first = np.array([row.run == 0 for row in o.rows])
    more = np.concatenate([np.arange(len(first)), np.flatnonzero(first)])
    rows = (*o.rows, *(replace(row, run=run) for row in o.only(first).rows))
    both = replace(o.at(more), rows=rows)
    shifts = {}
    for key, each in sizes.items():
        switched = dict(each)
        for change in changes:
            switched = change.applied(switched, _count(each))
        later = _shifts(problem, switched, d)[:, first]
        shifts[key] = np.hstack([now.shifts[key], later])
    sigma = problem.covariance(both, problem.constants[more])
    return CandidateRows(sigma, now.jacobian[more], shifts)


def _along(nodes: EffectResponse, e: float, slope: Array) -> Array:
    """Shift of further rows (m,) by an effect of parameter e, whose slopes by it are known at 0:
    they bend as the rows for which it was evaluated do, on the whole; 0 where there is no slope."""
    line, bent = nodes.slope[nodes.values == 0][0] * e, nodes.shift_at(np.array([e]))[0]
    known = np.isfinite(line)
    share = bent[known] @ line[known] / (line[known] @ line[known]) if line[known].any() else 1.0
    return np.nan_to_num(slope) * e * share


def _farthest(shifts: Array) -> int:
    """Place of the size that moves the measured rows most, from their shifts (q, n). Not the mean
    size: that of an effect which may have either sign is next to 0, and shows nothing."""
    return int(np.argmax((shifts**2).sum(1)))


def _grown(shifts: Array) -> Array:
    """How much of the largest shift (n,) of the measured rows there is at each size (q,)."""
    largest = shifts[_farthest(shifts)]
    whole = largest @ largest
    return np.asarray(shifts @ largest / whole) if whole > 0 else np.ones(len(shifts))


def _more_rows(
    problem: InverseProblem,
    now: CandidateRows,
    d: Array,
    sizes: Mapping[str, Sizes],
    further: OtherStates,
) -> list[tuple[str, float, CandidateRows]]:
    """Other pressures, higher harmonics and the mass, as far as the model has an answer where the
    explanations move the measured rows most; at other sizes, in proportion to these rows."""
    o = problem.observations
    labels = sorted({row.label for row in o.rows if row.label}, key=str)
    pressures = sorted({row.pressure_kPa for row in o.rows if row.label})
    offered: list[tuple[str, float, list[ModelRow]]] = []
    for p in offered_kPa(further.inflation_kPa, pressures):
        more: list[ModelRow] = [(label, p) for label in labels]
        offered.append((f"measure the same modes at {p:g} kPa", COST_HOURS["pressure"], more))
    top = max(label.c for label in labels)
    higher = [Label(top + 1, 0), Label(top + 1, 1)]
    measured_in = dict.fromkeys(row.row[1] for row in o.rows if row.label)
    more = [(label, where) for label in higher for where in measured_in]
    offered.append((f"measure {higher[0]} and {higher[1]} too", COST_HOURS["harmonics"], more))
    if all(row.label for row in o.rows):
        offered.append(("weigh the tyre", COST_HOURS["weigh"], [(None, 0.0)]))
    rows = list(dict.fromkeys(row for _, _, more in offered for row in more))
    model = further.model(rows)
    x = problem.expansion.x0 + d
    known = {key: _shifts(problem, each, d) for key, each in sizes.items()}
    farthest = [
        {id: float(e[_farthest(known[key])]) for id, e in each.items()}
        for key, each in sizes.items()
    ]
    bent = {id for id, each in problem.expansion.nodes.items() if each.sloped[each.values == 0]}
    lines = tuple(
        {id: 0.0 for each in farthest for id in each if id in model.sloped_at_0 and id in bent}
    )
    rest = [{id: e for id, e in each.items() if id not in lines} for each in farthest]
    evaluated = [each for each in rest if each][:MAX_EVALUATED]
    points = [
        Query(x, constants=True, slopes=lines),
        *(Query(x, each, near=x) for each in evaluated),
    ]
    answers = model.answers(points)
    if not all(isinstance(answer, Answer) for answer in answers):
        return []
    plain, *others = [answer for answer in answers if isinstance(answer, Answer)]
    assert plain.constants is not None
    added = {}
    for key, far, own in zip(sizes, farthest, rest, strict=True):
        if own and own not in evaluated:
            continue
        other = others[evaluated.index(own)] if own else plain
        here = sum(
            (
                _along(problem.expansion.nodes[id], far[id], plain.slopes[id])
                for id in lines
                if id in far
            ),
            other.eta - plain.eta,
        )
        added[key] = _grown(known[key])[:, None] * here
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
        shifts = {key: np.hstack([now.shifts[key], more[:, at]]) for key, more in added.items()}
        jacobian = np.vstack([now.jacobian, plain.jacobian[at]])
        sigma = problem.covariance(both, constants)
        result.append((words, hours, CandidateRows(sigma, jacobian, shifts)))
    return result
