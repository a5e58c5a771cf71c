"""Public values of a 205/60R15, predicted from its size code and a few of them.

    python -m tests.studies.real_prior CASE FIT.JSON

CASE is `tyrecal init 205/60R15 --pressure-kPa 220`, FIT.JSON of `tyrecal fit CASE --prior` to
cases/205_60r15_few.csv on the coarse mesh. With y = ln q of those values, eta = ln q of the fitted
design, x that of its variables and x0 their starts, everything uncertain is normal about the start:

    mean m = eta + J (x0 - x),   T = Sigma + J diag(s)^2 J^T       of all rows
    predicted: m_b + T_ba T_aa^-1 (y_a - m_a),   T_bb - T_ba T_aa^-1 T_ab

a: fitted rows, whose scatter is in T_aa; b: the others of cases/205_60r15_public.csv. Sigma: by
section, constants, material laws and mesh (`fit.model_errors`), so that section and constants move,
too, as in `sample`. Printed: the published value; then before and after the fit the value, its
standard deviation in %, and how far off the published one is, in these.

Set A is that of the fitted values, set B another of this size (`stiffness`).

Before it: damping, by the loss factor of all compounds that gives [1,0] its ratio of set A, so that
the others are predicted with its scatter, 25 %; stiffnesses of the rim, of the fitted design, for
which no sensitivities exist, so that they have no interval.
"""

from __future__ import annotations

import sys
from math import log, radians
from pathlib import Path

import numpy as np

from tests.conftest import CASES
from tests.studies.stiffness import PUBLISHED, SET_B, published
from tyrecal.measured.tables import read_measurements
from tyrecal.measured.targets import with_measured
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.studies.fit.prior import PriorProblem
from tyrecal.studies.fit.targets import Target
from tyrecal.studies.fitted import as_fitted
from tyrecal.studies.stiffness import run
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.schema import Rubber
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import set_values

SHOWN = {"vertical_stiffness_N_per_m": 1e-3, "contact_length_m": 1e3, "contact_width_m": 1e3}
DAMPING = {  # per cent, of the sets A and B
    "[1,0]": (5.6, 4.881),
    "[0,0] axial": (3.7, 0.5),
    "[1,1]": (0.7, 10.0),
    "[0,0] torsional": (5.0, 5.157),
}
SET_B_HZ = {"[0,0] axial": 41.47, "[0,0] torsional": 67.73, "[1,1]": 53.46}
STATES = (220.0, (2000.0, 4000.0, 6000.0)), (198.0, (4000.0,)), (242.0, (4000.0,))  # kPa, N
DAMPING_SCATTER = 0.25  # relative, of a published damping ratio


def table(case: LoadedCase, fitted: LoadedCase) -> None:
    """The other values, before and after the fit of ``case`` that ``fitted`` has."""
    given = {each.value for each in read_measurements(CASES / "205_60r15_few.csv")}
    wide, _ = with_measured(fitted, CASES / "205_60r15_public.csv")
    problem = PriorProblem(wide, Evaluator(TyreDesign(wide)))
    point = problem.evaluate(problem.start())
    assert problem.model is not None and problem.spread is not None
    eta, J = problem._counted(point.plain)
    known, a = np.log(problem.reference), np.array([x.value in given for x in problem.counted])
    start = [v.scaled(start_values(case)[v.name]) for v in problem.variables]
    mean = np.log(eta) + J @ (start - point.x)
    moved = J * problem.spread
    T = problem.model.covariance(np.where(a, problem.scatter, 0.0)) + moved @ moved.T
    gain = T[:, a] @ np.linalg.inv(T[np.ix_(a, a)])
    states = (mean, T), (mean + gain @ (known - mean)[a], T - gain @ T[a])
    print("\n| value | published | before | sd % | off, sd | after | sd % | off, sd |")
    print("|---|---|---|---|---|---|---|---|")
    for i in np.flatnonzero(~a):
        each = problem.counted[i]
        scale, state = SHOWN.get(each.quantity, 1.0), each.state.with_defaults(wide)
        name = str(each.label) if isinstance(each, Target) else each.quantity
        values = {"": each.value}
        if state.pressure_kPa == 220 and name in SET_B_HZ:
            values[", set B"] = SET_B_HZ[name]
        for which, public in values.items():
            cells = [f"{scale * public:.4g}"]
            for value, variance in states:
                sd = np.sqrt(variance[i, i])
                off = (log(public) - value[i]) / sd
                cells += [f"{scale * np.exp(value[i]):.1f}", f"{100 * sd:.1f}", f"{off:+.1f}"]
            at = f" {state.pressure_kPa:g} kPa {state.load_N:g} N{which}"
            print(f"| {name}{at} | {' | '.join(cells)} |", flush=True)


def damping(fitted: LoadedCase) -> None:
    """Damping ratios, by the loss factor that gives [1,0] its own."""
    rubbers = [name for name, m in fitted.case.materials.items() if isinstance(m, Rubber)]
    lossy = set_values(fitted, {f"materials.{name}.loss_factor": 0.2 for name in rubbers})
    modes = paired_labels(Evaluator(TyreDesign(lossy)).evaluate(Question({})).modes)
    ratios = {str(mode.label): mode.raw.damping_ratio for mode in modes}
    first = ratios["[1,0]"]
    assert first
    print(f"\none loss factor: {0.2 * DAMPING['[1,0]'][0] / 100 / first:.3f}\n")
    print("| mode | predicted, % | set A | off, sd | set B | off, sd |")
    print("|---|---|---|---|---|---|")
    for label, sets in DAMPING.items():
        own = (ratios[label] or 0.0) / first * DAMPING["[1,0]"][0]
        cells = [f"{each:.1f} | {log(each / own) / DAMPING_SCATTER:+.1f}" for each in sets]
        print(f"| {label} | {own:.1f} | {' | '.join(cells)} |")


def stiffnesses(fitted: LoadedCase) -> None:
    """Stiffnesses of the rim over load and pressure."""
    print("\n| stiffness | predicted | set A | off % | set B | off % |")
    print("|---|---|---|---|---|---|")
    for kPa, loads_N in STATES:
        for row in run(fitted, Evaluator(TyreDesign(fitted)), {"fitted": {}}, loads_N, [kPa]).rows:
            sets = [published(row.load_N, kPa, known) for known in (PUBLISHED, SET_B)]
            for name in PUBLISHED:
                unit, ours = radians(1) if name.endswith("rad") else 1e-3, getattr(row, name)
                cells = [f"{unit * x[name]:.1f} | {100 * ours / x[name] - 100:+.1f}" for x in sets]
                at = f"{name} {row.load_N:g} N {kPa:g} kPa"
                print(f"| {at} | {unit * ours:.1f} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    path, fit = map(Path, sys.argv[1:])
    read = load_case(path)
    as_fit = as_fitted(fit, read)
    damping(as_fit)
    stiffnesses(as_fit)
    table(read, as_fit)
