"""Whether a fit's stated standard errors hold over drawn tyres.

    python -m tests.studies.fit_errors [COUNT] [SEED] [SIZE ...]

Each tyre is drawn as its case states what is uncertain: fields of the section, constants, material
laws, and 0.3 % of scatter of each frequency at two pressures. Its variables are drawn within 20 %
of the start, coarse mesh. `fit` is then given the case as it is. Printed by size and variable: how
often the 90 % interval value +- 1.645 standard_error_total holds the truth, and the root mean
square of (fitted - truth) over standard_error and over standard_error_total.

Of 100 tyres a true 90 % interval holds 84 to 95 in 90 % of such studies.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.find import LabelledModes, find_modes
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.covariance import by_laws
from tyrecal.studies.diagnose.form_error import MATERIAL_LAWS
from tyrecal.studies.diagnose.observations import Observable
from tyrecal.studies.diagnose.section_fields import fields, with_fields
from tyrecal.studies.diagnose.uncertainties import EFFECT_PATH, sources, values_of
from tyrecal.studies.fit.calibrate import calibrate
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.case.schema import TargetMode, Targets
from tyrecal.tyre.effects.edit import changed
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .wrinkles import by_size

SIZES = ("P235/75R17", "205/60R15", "225/45R17")
NOISE, WITHIN, SHARES, QUANTILE_90 = 0.003, 0.2, (0.85, 1.15), 1.645
LABELS = [
    *(Label(0, 0, kind) for kind in ("axial", "torsional")),
    *(Label(c, m) for c, m in ((1, 0), (1, 1), (2, 0), (2, 1), (3, 0), (3, 1), (4, 0))),
]


def case_of(size: str) -> LoadedCase:
    """The shipped case, or that of a size code, on its coarse mesh."""
    case = load_case(CASES / "p235_75r17.yaml") if size == SIZES[0] else by_size(size)
    return with_level(case, "coarse")


def frequencies(case: LoadedCase, values: dict[str, float], pressures: Sequence[float]) -> list:
    """Hz of `LABELS` at each pressure. Raises EvaluationFailed."""
    evaluator, hertz = Evaluator(TyreDesign(case)), []
    questions = [Question({**values, "pressure_kPa": p}) for p in pressures]
    for _, answer in sorted(find_modes(evaluator, questions, lambda *_: LABELS, 1)):
        if not isinstance(answer, LabelledModes):
            raise answer
        hertz += [answer.wanted[label].frequency_Hz for label in LABELS]
    return hertz


def drawn(case: LoadedCase, random: np.random.Generator) -> tuple[LoadedCase, dict[str, float]]:
    """The case with what a drawn tyre measures as its targets, and the tyre's variables."""
    start, nominal = start_values(case), case.case.pressure_kPa
    truth = {name: v * float(np.exp(random.uniform(-WITHIN, WITHIN))) for name, v in start.items()}
    known, _ = sources(case)
    own, off = values_of(case, known), dict[str, float]()
    pressure_off = 0.0
    for source in known:
        amount = float(random.normal())
        for path, step in source.steps.items():
            if path == "pressure_kPa":
                pressure_off = amount * step
            elif path.startswith(EFFECT_PATH):
                off[path] = amount * step
            else:
                off[path] = own[path] + amount * step
    tyre = with_fields(case, {name: float(random.normal()) for name in fields(case)})
    pressures = [share * nominal for share in SHARES]
    hertz = frequencies(tyre, {**truth, **off}, [p + pressure_off for p in pressures])
    rows = tuple(Observable("frequency_Hz", label, p) for p in pressures for label in LABELS)
    laws = MATERIAL_LAWS * np.linalg.cholesky(by_laws(rows) + 1e-9 * np.eye(len(rows)))
    noise = laws @ random.normal(size=len(rows)) + NOISE * random.normal(size=len(rows))
    modes = [
        TargetMode(
            c=row.label.c,
            m=row.label.m,
            kind=row.label.kind,
            frequency_Hz=f,
            sigma_Hz=NOISE * f,
            pressure_kPa=row.pressure_kPa,
        )
        for row, f in zip(rows, hertz * np.exp(noise), strict=True)
        if row.label
    ]
    return changed(case, targets=Targets(modes=modes)), truth


def main(count: int, seed: int, sizes: Sequence[str]) -> None:
    """Print the table."""
    print("| size | variable | held in 90 % | rms by scatter | rms by total | chi2/dof |")
    print("|---" * 6 + "|")
    for size in sizes:
        case, random = case_of(size), np.random.default_rng([seed, SIZES.index(size)])
        rows: dict[str, list[tuple[float, float]]] = {}
        chi2, failed = list[float](), 0
        while len(chi2) < count:
            try:
                measured, truth = drawn(case, random)
                fit = calibrate(measured, Evaluator(TyreDesign(measured)), "gauss-newton").found
            except (EvaluationFailed, ValueError):
                failed += 1
                continue
            chi2.append(fit.chi2_per_dof or np.nan)
            for name, v in fit.variables.items():
                if v.at_bound or not v.standard_error or not v.standard_error_total:
                    continue
                off = np.log(v.value / truth[name]) * v.value
                by_both = off / v.standard_error, off / v.standard_error_total
                rows.setdefault(name, []).append(by_both)
        for name, each in rows.items():
            scatter, total = np.array(each).T
            held = int((abs(total) <= QUANTILE_90).sum())
            rms = [f"{np.sqrt(np.mean(x**2)):.2f}" for x in (scatter, total)]
            print(
                f"| {size} | {name} | {held} of {len(each)} | {rms[0]} | {rms[1]} |"
                f" {np.mean(chi2):.2f} |",
                flush=True,
            )
        print(f"{size}: {failed} drawn tyres could not be evaluated", flush=True)


if __name__ == "__main__":
    numbers = [int(x) for x in sys.argv[1:3]]
    main(*(*numbers, *(100, 1)[len(numbers) :]), sys.argv[3:] or SIZES)
