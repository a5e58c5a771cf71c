"""Model-form error of every mode: mesh and element of our own model, at the fitted design.

    python -m tests.studies.form_error
    python -m tests.studies.form_error 205/60R15 11R22.5  # of tyres as `tyrecal init` writes them

For each variant: d = ln f_variant - ln f_default of all modes at three pressures; what the three
design variables can absorb is taken out by least squares, as a calibration would; the rest is the
error of form. Printed: its rms over variants and pressures, per mode, in per cent, times
sqrt(n / (n - v)) for the directions that were taken out. Then the length l of ln p over which that
rest r is alike: rho = 2 sum r r' / (sum r^2 + sum r'^2) of two pressures is
exp(-(ln p - ln p')^2 / (2 l^2)).
No measured data enter.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tests.conftest import CASES
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.parts import Level
from tyrecal.tyre.load import load_case

from .wrinkles import by_size

PRESSURES = 2 / 3, 1.0, 4 / 3  # of the case's
Array = np.ndarray
LABELS = [Label(0, 0, "axial"), Label(0, 0, "torsional")]
LABELS += [Label(c, m) for c in range(1, 7) for m in (0, 1)]
FITTED = {"A_belt": 2.543e-7, "A_carcass": 6.198e-8, "C10": 6.526e5}
FLOOR = 0.1  # per cent: difference of two solvers on one mesh (tests/benchmarks/CALCULIX.md)


def variants(case: LoadedCase) -> dict[str, LoadedCase]:
    """The case with the refined mesh, with coarser ones, and with linear elements."""
    mesh = case.case.mesh
    default = mesh.levels["default"]
    rows = [*default.rows[:-1], 2]
    coarse = Level(elements={k: max(1, v * 3 // 4) for k, v in default.elements.items()}, rows=rows)
    thick = Level(elements=default.elements, rows=rows)
    levels = {**mesh.levels, "coarse": coarse, "thick": thick}
    changed = {
        "refined": {"level": "refined"},
        "coarser": {"level": "coarse"},
        "fewer rows": {"level": "thick"},
        "linear elements, refined": {"level": "refined", "element": "CGAX4R"},
    }
    return {
        name: replace(
            case,
            case=case.case.model_copy(
                update={"mesh": mesh.model_copy(update={"levels": levels, **update})}
            ),
        )
        for name, update in changed.items()
    }


def answer(case: LoadedCase, labels: Sequence[Label], design: Mapping[str, float]) -> Answer:
    """The model's answer at a design."""
    rows = [(label, share * case.case.pressure_kPa) for share in PRESSURES for label in labels]
    model = TyreModel(case, Evaluator(TyreDesign(case)), rows, [], {})
    (result,) = model.answers([Query(np.log([design[name] for name in model.variables]))])
    assert isinstance(result, Answer), result
    return result


def main(sizes: Sequence[str]) -> None:
    if not sizes:
        by_mode, length = computed(print)
        for label, percent in by_mode.items():
            print(f'    "{label}": {percent:.2f},')
        print(f"alike over {length:.2f} of ln p")
    for size in sizes:
        case = by_size(size)
        labels = [label for label in LABELS if label.c <= case.case.analysis.highest_harmonic]
        own, _ = left(case, labels, start_values(case), print)
        shares = (f"{label} {100 * sigma:.2f}" for label, sigma in zip(labels, own, strict=True))
        print(size, ", ".join(shares))


def computed(tell: Callable[[str], None] = lambda line: None) -> tuple[dict[str, float], float]:
    """Per cent by mode, and the length of ln p."""
    own, errors = left(load_case(CASES / "p235_75r17.yaml"), LABELS, FITTED, tell)
    percent = {str(x): max(FLOOR, 100 * sigma) for x, sigma in zip(LABELS, own, strict=True)}
    return percent, alike_over(np.concatenate(errors, axis=1))


def left(
    case: LoadedCase,
    labels: Sequence[Label],
    design: Mapping[str, float],
    tell: Callable[[str], None],
) -> tuple[Array, list[Array]]:
    """Rest of ln f after calibration: rms by mode, and by variant (pressures, labels)."""
    plain = answer(case, labels, design)
    J, errors = plain.jacobian, []
    n, v = J.shape
    for name, variant in variants(case).items():
        d = answer(variant, labels, design).eta - plain.eta
        rest = d - J @ np.linalg.lstsq(J, d, rcond=None)[0]
        errors.append(rest.reshape(len(PRESSURES), -1))
        raw, after = (100 * np.sqrt(np.mean(x**2)) for x in (d, rest))
        tell(f"{name}: rms {raw:.2f} %, {after:.2f} % after calibration")
    return np.sqrt(np.mean(np.square(errors), axis=(0, 1)) * n / (n - v)), errors


def alike_over(rest: Array) -> float:
    """l by least squares of -ln rho = (ln p - ln p')^2 / (2 l^2), errors (pressures, n)."""
    square = (rest**2).sum(1)
    rho = 2 * (rest @ rest.T) / np.add.outer(square, square)
    pairs = np.triu_indices(len(rest), 1)
    half = np.log(np.divide.outer(PRESSURES, PRESSURES))[pairs] ** 2 / 2
    return float(np.sqrt(half @ half / (half @ -np.log(rho[pairs]))))


if __name__ == "__main__":
    main(sys.argv[1:])
