"""Whether modes, fit and footprint agree that tyres with drawn belts are stable.

    python -m tests.studies.belts [COUNT] [SEED] [--bears-compression] [--calculix N] >> belts.jsonl

Tyres that `tyrecal init` writes, six sizes in turn, coarse mesh: belts at 16 to 30 degrees from the
circumference, and 0.6 to 1.2 of the pressure of the size. Each is evaluated as `modes` does it, as
`fit` does it (with the sensitivities of all variables), and pressed by 5 % of its rated load as
`footprint` does it. With --bears-compression no cord goes slack, which carcasses under such belts
do not survive. A line of JSON for each tyre has the failure of each evaluation, "" if there is
none; --calculix: of the first N tyres also the largest deviation from CalculiX, % of a frequency of
one discrete problem (`calculix`).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.fit.problem import Problem
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.case.schema import TargetMode, Targets
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.section.size import parse_size

from . import calculix
from .wrinkles import by_size, with_compression

SIZES = ("155/80R13", "205/55R16", "225/45R17", "275/40R20", "11R22.5", "315/80R22.5")
ANGLES_DEG, PRESSURES = (16.0, 30.0), (0.6, 1.2)  # from the circumference; of the size's pressure
WORKING_DEG = 60.0  # a belt that is nearer to the meridian is one that props the others
LOAD_SHARE = 0.05
ANY_HZ = 100.0  # of targets, which only say that the modes are evaluated
MODES = ((1, 0), (1, 1), (2, 0), (2, 1), (3, 0))


def with_belts(case: LoadedCase, angle_deg: float, pressure_kPa: float) -> LoadedCase:
    """A case with belts so far from the circumference, and targets to evaluate."""
    layers = dict(case.case.rebar_layers)
    for name, layer in layers.items():
        if name.startswith("belt") and abs(layer.angle_deg - 90) <= 90 - WORKING_DEG:
            sign = np.sign(layer.angle_deg - 90)
            layers[name] = with_part(layer, angle_deg=90 + sign * angle_deg)
    targets = Targets(modes=[TargetMode(c=c, m=m, frequency_Hz=ANY_HZ) for c, m in MODES])
    return changed(case, rebar_layers=layers, pressure_kPa=pressure_kPa, targets=targets)


def failures(case: LoadedCase, load_N: float) -> dict[str, str]:
    """Why each command would fail, "" if it does not."""
    start = start_values(case)
    problem = Problem(case, Evaluator(TyreDesign(case)))
    ways: dict[str, Callable[[], Any]] = {
        "modes": lambda: Evaluator(TyreDesign(case)).evaluate(Question(start)),
        "fit": lambda: problem.evaluate(problem.start()),
        "footprint": lambda: Evaluator(TyreDesign(case)).press(start, [load_N]),
    }
    return {name: _failure(way) for name, way in ways.items()}


def _failure(way: Callable[[], Any]) -> str:
    try:
        answer = way()
    except EvaluationFailed as failure:
        return f"{failure.cause}: {failure.words}"
    failed = getattr(answer, "failed", None)
    return f"{failed.cause}: {failed.words}" if failed else ""


def tyres(count: int, seed: int, bears: bool | None) -> Iterator[tuple[dict[str, Any], LoadedCase]]:
    """Drawn tyres; bears: whether all cords bear compression, None: as `init` has it."""
    random, cases = np.random.default_rng([seed, 16]), dict[str, LoadedCase]()
    for k in range(count):
        size = SIZES[k % len(SIZES)]
        if size not in cases:
            case = with_level(by_size(size), "coarse")
            cases[size] = case if bears is None else with_compression(case, bears)
        angle, share = random.uniform(*ANGLES_DEG), random.uniform(*PRESSURES)
        case = with_belts(cases[size], angle, share * cases[size].case.pressure_kPa)
        yield {"size": size, "angle_deg": round(angle, 2), "pressure": round(share, 3)}, case


def off_calculix(case: LoadedCase) -> float | str:
    """The largest deviation of a target mode from CalculiX, %, or why there is none."""
    try:
        rows = calculix.compare(case, None)
    except EvaluationFailed as failure:
        return f"{failure.cause}: {failure.words}"
    return max((row.common for row in rows), key=abs)


def main(count: int, seed: int, bears: bool | None, by_calculix: int) -> None:
    """Print the lines."""
    for k, (drawn, case) in enumerate(tyres(count, seed, bears)):
        line = {**drawn, **failures(case, LOAD_SHARE * parse_size(drawn["size"]).load_N)}
        if k < by_calculix:
            line["off_calculix_percent"] = off_calculix(case)
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", nargs="?", type=int, default=60)
    parser.add_argument("seed", nargs="?", type=int, default=1)
    parser.add_argument("--bears-compression", action="store_true")
    parser.add_argument("--calculix", type=int, default=0)
    given = parser.parse_args()
    main(given.count, given.seed, True if given.bears_compression else None, given.calculix)
