"""Does a section, within what tyres are, answer both columns of the paper's Table 2?

    python -m tests.studies.both_columns [p235_75r17|p235_75r17_narrow_rim] [--inferred]

The paper's initial and optimised designs are evaluated side by side. Numbers of the section move
alike in both, within bounds, until the 18 frequencies are as near to the paper's as they come
(least squares of ln f, doublets twice, exact slopes, two starts): the section and the plies alone
or, with --inferred, also what the paper does not print and the cases have from elsewhere: moduli
and densities. The search is on the coarse mesh, whose differences from the default one are taken
at the case's own section; what is told is of the default mesh: each frequency's deviation and
change between the columns, the paper's beside them, and where the numbers end.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from tests.conftest import CASES
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.find import LabelledModes, find_modes
from tyrecal.studies.fit.targets import target_labels
from tyrecal.studies.variable import DesignVariable, read_variable
from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.case.schema import Variable
from tyrecal.tyre.load import load_case

Array = np.ndarray

COLUMNS = (
    {"A_belt": 2.11868e-7, "A_carcass": 4.20835e-7, "C10": 1e6},
    {"A_belt": 3.64826e-7, "A_carcass": 8.01133e-8, "C10": 1e6 + 0.01489},
)
PAPER_HZ = (
    (36.85, 37.17, 43.85, 65.07, 76.33, 86.65, 104.36, 117.07, 122.65),
    (30.86, 35.85, 36.92, 58.75, 68.41, 78.67, 96.42, 107.9, 114.9),
)
SECTION = {  # effects as numbers of the section: lower, upper
    "belt_width": (-0.02, 0.02),  # m; belts of 0.7 to 0.85 of the section's width
    "sidewall_gauge": (-0.3, 0.3),
    "bead_filler": (0.0, 3.0),
    "tread_wear": (0.0, 0.5),
    "rim_width": (-0.0254, 0.0127),  # m
    "carcass_turn_up": (0.0, 1.0),
    "belt_angle": (-3.0, 3.0),  # degrees
}
INFERRED = {  # not in the paper: factors to either side
    "materials.belt_cord.youngs_modulus_Pa": 1.2,  # steel
    "materials.carcass_cord.youngs_modulus_Pa": 5.0,
    "materials.belt_cord.density_kg_per_m3": 1.3,
    "materials.carcass_cord.density_kg_per_m3": 1.3,
    "materials.rubber.density_kg_per_m3": 1.1,
}


def with_variables(case: LoadedCase, inferred: bool) -> LoadedCase:
    """The case with these numbers as variables, beside its own."""
    variables = dict(case.case.variables)
    for name, (lower, upper) in SECTION.items():
        variables[name] = Variable(
            sets=[f"effects.{name}"], start=0.0, lower=lower, upper=upper, scale="linear"
        )
    for path, factor in INFERRED.items() if inferred else ():
        part = getattr(case.case.materials[path.split(".")[1]], path.split(".")[2])
        variables[path.replace(".", "_").removeprefix("materials_")] = Variable(
            sets=[path], start=part, lower=part / factor, upper=part * factor
        )
    return replace(case, case=case.case.model_copy(update={"variables": variables}))


MOST_EVALUATIONS = 20
TURNED_UP = {"carcass_turn_up": 0.9, "bead_filler": 1.0}  # the second start


class BothColumns:
    """Frequencies of both columns by the free variables."""

    def __init__(self, case: LoadedCase):
        self.labels = target_labels(case)
        self.evaluator = Evaluator(TyreDesign(case))
        self.free: list[DesignVariable] = [
            read_variable(case, name) for name in case.case.variables if name not in COLUMNS[0]
        ]
        self.weight = np.tile(np.sqrt([2.0 if label.c else 1.0 for label in self.labels]), 2)
        self.start = np.array([v.scaled(v.start) for v in self.free])
        self.known: dict[bytes, tuple[Array, Array]] = {}

    def at(self, x: Array) -> tuple[Array, Array]:
        """ln f (18,) and slopes (18, v) by the coordinates."""
        if x.tobytes() not in self.known:
            own = {v.name: v.value(float(c)) for v, c in zip(self.free, x, strict=True)}
            rows = [self._column({**own, **column}, own) for column in COLUMNS]
            self.known[x.tobytes()] = (
                np.concatenate([each[0] for each in rows]),
                np.vstack([each[1] for each in rows]),
            )
        return self.known[x.tobytes()]

    def _column(self, values: Mapping[str, float], own: Mapping[str, float]) -> tuple[Array, Array]:
        question = Question(values, tuple(own))
        ((_, labelled),) = find_modes(self.evaluator, [question], self.labels)
        assert isinstance(labelled, LabelledModes), labelled
        hertz = np.array([labelled.wanted[label].frequency_Hz for label in self.labels])
        places = [labelled.wanted[label].position for label in self.labels]
        rows = [
            np.asarray(labelled.evaluation.gradients[v.name])[places] * v.slope(own[v.name]) / hertz
            for v in self.free
        ]
        return np.log(hertz), np.array(rows).T

    def fitted(self, target: Array) -> Array:
        """Coordinates of the least squares to ln f (18,), the better one of two starts."""
        turned = self.start.copy()
        for i, v in enumerate(self.free):
            turned[i] = v.scaled(TURNED_UP.get(v.name, v.start))
        fits = [self._fitted_from(start, target) for start in (self.start, turned)]
        return min(
            fits, key=lambda x: float(np.linalg.norm(self.weight * (self.at(x)[0] - target)))
        )

    def _fitted_from(self, start: Array, target: Array) -> Array:
        lower = np.array([v.scaled(v.lower) for v in self.free])
        upper = np.array([v.scaled(v.upper) for v in self.free])
        answer = least_squares(
            lambda x: self.weight * (self.at(x)[0] - target),
            np.clip(start, lower + 1e-6, upper - 1e-6),
            lambda x: self.weight[:, None] * self.at(x)[1],
            bounds=(lower, upper),
            x_scale=upper - lower,
            max_nfev=MOST_EVALUATIONS,
        )
        return np.asarray(answer.x)


def tell(title: str, labels: Sequence[object], ln_f: Array) -> None:
    """Deviations from the paper, %, and changes between the columns."""
    hertz, paper = np.exp(ln_f).reshape(2, -1), np.array(PAPER_HZ)
    twice = np.array([2.0 if label.c else 1.0 for label in labels])  # type: ignore[attr-defined]
    objective = [np.sqrt(np.sum(twice * (h - p) ** 2)) for h, p in zip(hertz, paper, strict=True)]
    target = np.array([31.7, 35.0, 37.8, 58.5, 66.1, 79.5, 97.6, 102.7, 115.9])
    to_measured = [np.sqrt(np.sum(twice * (h - target) ** 2)) for h in hertz]
    print(
        f"\n{title}: off the paper {objective[0]:.2f} and {objective[1]:.2f} Hz; equation (1)",
        end="",
    )
    print(f" {to_measured[0]:.2f} -> {to_measured[1]:.2f} Hz (the paper 33.13 -> 8.60)")
    print("| mode | initial off, % | optimised off, % | change, % | the paper's |")
    for i, label in enumerate(labels):
        off = 100 * (hertz[:, i] / paper[:, i] - 1)
        change, own = (100 * (each[1, i] / each[0, i] - 1) for each in (hertz, paper))
        print(f"| {label} | {off[0]:+.1f} | {off[1]:+.1f} | {change:+.1f} | {own:+.1f} |")


def main(name: str, inferred: bool) -> None:
    """Print the case as it is, and as near as it comes."""
    case = with_variables(load_case(CASES / f"{name}.yaml"), inferred)
    fine, coarse = BothColumns(case), BothColumns(with_level(case, "coarse"))
    own = fine.at(fine.start)[0]
    tell(f"{name} as it is", fine.labels, own)
    x = coarse.fitted(np.log(PAPER_HZ).ravel() - own + coarse.at(coarse.start)[0])
    words = "section and what is inferred" if inferred else "section"
    tell(f"{name}, {words} ({len(coarse.known)} evaluations of both)", fine.labels, fine.at(x)[0])
    for v, c in zip(fine.free, x, strict=True):
        print(f"  {v.name} = {v.value(float(c)):.4g} ({v.lower:.4g} to {v.upper:.4g})")


if __name__ == "__main__":
    names = [word for word in sys.argv[1:] if not word.startswith("--")]
    main(names[0] if names else "p235_75r17", "--inferred" in sys.argv)
