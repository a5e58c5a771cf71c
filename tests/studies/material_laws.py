"""Shifts of modes by material laws other than the model's, and the pressures over which they are
alike.

    python -m tests.studies.material_laws

Laws that are the model's own at small strain: cords linear in Green's strain, as CalculiX has them;
rubber with a fifth of its shear modulus by C01; rubber that softens, C20 = -0.3 C10 and
C30 = 0.1 C10 (Yeoh), whose modulus is least, 30 % less, at a shear of 1, where W1 / C10 =
1 - 0.6 x + 0.3 x^2, x = I1 - 3 = 1. Of tyres as `tyrecal init` writes them, except that all cords
bear compression, as another law of a cord changes nothing where it is slack; and of the paper's as
it is fitted: d = ln f_other - ln f of all modes at three pressures, in three parts: what all share,
what a family has beside that, and a mode beside both. Printed: their rms in per cent, and the
length l of ln p over which they are alike:
rho = 2 sum d d' / (sum d^2 + sum d'^2) = exp(-(ln p - ln p')^2 / (2 l^2)).
No measured data enter.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager

import numpy as np

from tests.conftest import CASES
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case

from .calculix import common, rewritten
from .form_error import FITTED, LABELS, PRESSURES, alike_over
from .wrinkles import by_size, with_compression

Array = np.ndarray
SIZES_OF_LAWS = ["175/70R13", "205/60R15", "275/40R20", "11R22.5"]
IN_C01 = 0.2  # of the shear modulus
SOFTENING = -0.3, 0.1  # C20 and C30 over C10
RUBBER = re.compile(r"(\*HYPERELASTIC, )MOONEY-RIVLIN([^\n]*)\n\s*([^,\n]+),([^,\n]+),([^,\n]+)\n")


def with_law(
    law: str, constants: Callable[[float, float], Sequence[float]]
) -> Callable[[str], str]:
    """A deck's text with another law of rubber: its name and constants, from C10 + C01 and D1."""

    def other(match: re.Match[str]) -> str:
        start, more, *numbers = match.groups()
        C10, C01, D1 = map(float, numbers)
        line = ", ".join(f"{x:.15g}" for x in constants(C10 + C01, D1))
        return f"{start}{law}{more}\n{line}\n"

    return lambda text: RUBBER.sub(other, text)


def others() -> dict[str, AbstractContextManager[None]]:
    """Contexts in which the bundled solver has other laws, by what they are."""
    mooney = with_law("MOONEY-RIVLIN", lambda C, D1: ((1 - IN_C01) * C, IN_C01 * C, D1))
    yeoh = with_law("YEOH", lambda C, D1: (C, *(share * C for share in SOFTENING), D1, 0.0, 0.0))
    return {
        "cords by Green's strain": common(sides=False),
        "a fifth of the modulus by C01": rewritten(mooney),
        "rubber that softens": rewritten(yeoh),
    }


def values(case: LoadedCase, labels: Sequence[Label], design: Mapping[str, float]) -> Array:
    """ln f (pressures, modes) at a design, or at the case's own."""
    rows = [(label, share * case.case.pressure_kPa) for share in PRESSURES for label in labels]
    model = TyreModel(case, Evaluator(TyreDesign(case)), rows, [], {})
    x = np.log([design[name] for name in model.variables]) if design else model.start
    return model.values_at(x).reshape(len(PRESSURES), -1)


def parts(d: Array, labels: Sequence[Label]) -> list[Array]:
    """The part of d (pressures, modes) that all modes share, the further part of a family, and that
    of a mode."""
    shared = np.broadcast_to(d.mean(1, keepdims=True), d.shape)
    families = np.zeros_like(d)
    for family in {label.family for label in labels}:
        of = [label.family == family for label in labels]
        families[:, of] = (d - shared)[:, of].mean(1, keepdims=True)
    return [shared, families, d - shared - families]


def computed(tell: Callable[[str], None] = lambda line: None) -> tuple[list[float], float]:
    """Per cent of each part over all tyres and laws, and the length of ln p of all of it."""
    tyres: dict[str, tuple[LoadedCase, Mapping[str, float]]] = {
        "P235/75R17, fitted": (load_case(CASES / "p235_75r17.yaml"), FITTED)
    }
    tyres |= {size: (with_compression(by_size(size), True), {}) for size in SIZES_OF_LAWS}
    all_parts: list[list[Array]] = []
    tell(f"| tyre | law | all, family, mode, % | length |\n{4 * '|---'}|")
    for name, (case, design) in tyres.items():
        labels = [label for label in LABELS if label.c <= case.case.analysis.highest_harmonic]
        plain = values(case, labels, design)
        for words, other in others().items():
            with other:
                d = values(case, labels, design) - plain
            all_parts.append(parts(d, labels))
            tell(f"| {name} | {words} | {_told(all_parts[-1])} | {alike_over(d):.1f} |")
    whole = [np.concatenate(each, axis=1) for each in zip(*all_parts, strict=True)]
    length = alike_over(sum(whole))
    tell(f"| all | all | {_told(whole)} | {length:.1f} |")
    return [_percent(part) for part in whole], length


def _percent(part: Array) -> float:
    return float(100 * np.sqrt(np.mean(part**2)))


def _told(each: Sequence[Array]) -> str:
    return ", ".join(f"{_percent(part):.2f}" for part in each)


if __name__ == "__main__":
    computed(print)
