"""Agreement of modes, fit and footprint that tyres with drawn belts are stable.

    python -m tests.studies.belts [COUNT] [SEED] [--bears-compression] [--pressed N] [--calculix N]

Tyres that `tyrecal init` writes, six sizes in turn, coarse mesh: belts at 16 to 30 degrees from the
circumference, and 0.6 to 1.2 of the pressure of the size. Each is evaluated as `modes` does it, as
`fit` does it (with the sensitivities of all variables), and inflated and judged as before a press
on the road by `footprint`. With --bears-compression no cord goes slack, which most carcasses under
such belts do not survive. A line of JSON is printed for each tyre, with the failure of each
evaluation, "" if there is none, and counts to stderr. Of the first N tyres: --pressed presses them
by 5 % of their rated load; --calculix states the largest deviation from CalculiX, % of a frequency
of one discrete problem (`calculix`), or why there is none. That problem has what CalculiX can
honour: cords that all bear compression, and the static moduli in vibration.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.errors import RunFailed

from tyrecal.simulate.deck.decks import Decks
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
COMMANDS = ("modes", "fit", "footprint")
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


class _Inflated(Exception):
    """The press has inflated the tyre, and judged it stable."""


class _InflatingJob(Job):
    """A press on the road that ends before the road touches the tyre."""

    def _on_road(self) -> Any:
        raise _Inflated


def inflated(case: LoadedCase, load_N: float) -> None:
    """Inflate and judge the tyre as a press does. Raises RunFailed."""
    texts = Decks(TyreDesign(case).at(start_values(case)), loads_N=(load_N,)).texts("abaqus")
    jobs = {name.removesuffix(".inp"): text for name, text in texts.items()}
    with suppress(_Inflated):
        _InflatingJob(Deck(jobs, "press", "inflate"), Request()).press()


def failures(case: LoadedCase, load_N: float, pressed: bool) -> dict[str, str]:
    """Reason why each command would fail, "" if it does not."""
    start = start_values(case)
    problem = Problem(case, Evaluator(TyreDesign(case)))
    ways: dict[str, Callable[[], Any]] = {
        "modes": lambda: Evaluator(TyreDesign(case)).evaluate(Question(start)),
        "fit": lambda: problem.evaluate(problem.start()),
        "footprint": lambda: inflated(case, load_N),
    }
    if pressed:
        ways["pressed"] = lambda: Evaluator(TyreDesign(case)).press(start, [load_N])
    return {name: _failure(way) for name, way in ways.items()}


def _failure(way: Callable[[], Any]) -> str:
    try:
        answer = way()
    except (EvaluationFailed, RunFailed) as failure:
        return f"{failure.cause}: {failure}".split(";")[0]
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
        drawn = {"size": size, "angle_deg": round(angle, 2), "pressure": round(share, 3)}
        yield drawn | ({"bears_compression": bears} if bears is not None else {}), case


def off_calculix(case: LoadedCase) -> float | str:
    """The largest deviation of a target mode from CalculiX, %, or why there is none."""
    analysis = with_part(case.case.analysis, vibration_frequency_Hz=None)
    case = with_compression(changed(case, analysis=analysis), True)
    try:
        rows = calculix.compare(case, None)
    except EvaluationFailed as failure:
        return f"{failure.cause}: {failure.words}"
    return max((row.common for row in rows), key=abs)


def counts(lines: Sequence[Mapping[str, Any]]) -> str:
    """Number of tyres that are computed, and about how many the commands agree."""
    causes = [{line[name].split(":")[0] for name in COMMANDS} for line in lines]
    agree = sum(len(each) == 1 for each in causes)
    computed = sum(each == {""} for each in causes)
    return f"{len(lines)} tyres, {computed} computed, the commands agree about {agree}"


def main(count: int, seed: int, bears: bool | None, pressed: int, by_calculix: int) -> None:
    """Print the lines, and the counts."""
    lines = []
    for k, (drawn, case) in enumerate(tyres(count, seed, bears)):
        load_N = LOAD_SHARE * parse_size(drawn["size"]).load_N
        lines.append({**drawn, **failures(case, load_N, k < pressed)})
        if k < by_calculix:
            lines[-1]["off_calculix_percent"] = off_calculix(case)
        print(json.dumps(lines[-1]), flush=True)
    print(counts(lines), file=sys.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", nargs="?", type=int, default=60)
    parser.add_argument("seed", nargs="?", type=int, default=1)
    parser.add_argument("--bears-compression", action="store_true")
    parser.add_argument("--pressed", type=int, default=0)
    parser.add_argument("--calculix", type=int, default=0)
    given = parser.parse_args()
    bears = True if given.bears_compression else None
    main(given.count, given.seed, bears, given.pressed, given.calculix)
