"""Time of one diagnosis, all effects and pairs, and what it asks the solver for.

    OPENBLAS_NUM_THREADS=1 python -m tests.benchmarks.diagnosis            # counts, times by kind
    OPENBLAS_NUM_THREADS=1 python -m tests.benchmarks.diagnosis --jobs 2   # wall time on two cores

Without ``--measured FILE`` the measurements are the model's own at three pressures, a bead filler
1.5 times as stiff in it. Nothing is recorded, and nothing comes from the record.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections import Counter, defaultdict
from dataclasses import dataclass, field, fields
from pathlib import Path
from tempfile import TemporaryDirectory

import click
import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.studies.diagnose.study import study
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.load import load_case

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
PRESSURES_kPa, EFFECT, SIZE, SCATTER = (160.0, 240.0, 320.0), "bead_filler", 0.5, 0.002


@dataclass
class Watched(Evaluator):
    """An evaluator that notes how often what was asked in this process, and for how long."""

    count: Counter[str] = field(default_factory=Counter)
    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))

    def evaluate(self, question: Question) -> Evaluation:
        """Evaluate as `Evaluator.evaluate` does, and count."""
        start = time.process_time()
        try:
            return super().evaluate(question)
        finally:
            effects = [path[8:] for path in question.values if path.startswith("effects.")]
            kind = "+".join(sorted(effects)) or "plain"
            kind += f", slopes by {len(question.gradients)}" if question.gradients else ""
            highest = self.design.request["highest_harmonic"]
            kind += (
                f", up to n = {highest}" if highest > LOADED.case.analysis.highest_harmonic else ""
            )
            self.count[kind] += 1
            self.seconds[kind] += time.process_time() - start

    def worker(self) -> Evaluator:
        """Counts with this one, where it stays in this process."""
        plain = super().worker()
        own = {each.name: getattr(plain, each.name) for each in fields(Evaluator)}
        return Watched(**own, count=self.count, seconds=self.seconds)


def processor_s(process: multiprocessing.process.BaseProcess) -> float:
    """Processor seconds that a process has used so far: fields 14 and 15 of its status on Linux."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


LOADED = load_case(CASE)
HARMONICS = LOADED.case.analysis.highest_harmonic


def made(case: LoadedCase, path: Path) -> Path:
    """A file of measurements: the model's own with an effect and scatter."""
    random, evaluator = np.random.default_rng(1), Evaluator(TyreDesign(case))
    wanted = {(t.c, t.m, t.kind) for t in case.case.targets.modes} if case.case.targets else set()
    lines = ["quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma"]
    for p in PRESSURES_kPa:
        values = {**start_values(case), "pressure_kPa": p, f"effects.{EFFECT}": SIZE}
        for mode in paired_labels(evaluator.evaluate(Question(values)).modes):
            x = mode.label
            if (x.c, x.m, x.kind) in wanted:
                f = mode.frequency_Hz * float(np.exp(SCATTER * random.normal()))
                place = f"{x.c},{x.m},{x.kind or ''},,{p:g}"
                lines.append(f"frequency_Hz,{place},0,{f:.3f},{SCATTER * f:.3f}")
    path.write_text("\n".join(lines) + "\n")
    return path


@click.command()
@click.option("--measured", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--jobs", default=1, show_default=True)
def main(measured: Path | None, jobs: int) -> None:
    """Diagnose once and print how long it took."""
    with TemporaryDirectory() as folder:
        measured = measured or made(LOADED, Path(folder) / "measured.csv")
        evaluator = Watched(TyreDesign(LOADED)) if jobs == 1 else Evaluator(TyreDesign(LOADED))
        wall, start = time.perf_counter(), time.process_time()
        result = study(LOADED, evaluator, measured, jobs=jobs)
        wall, own = time.perf_counter() - wall, time.process_time() - start
    workers = sum(map(processor_s, multiprocessing.active_children()))  # kept for more
    if isinstance(evaluator, Watched):
        print("| asked | evaluations | processor time, s | each, s |\n|---|---|---|---|")
        for kind, seconds in sorted(evaluator.seconds.items(), key=lambda item: -item[1]):
            count = evaluator.count[kind]
            print(f"| {kind} | {count} | {seconds:.2f} | {seconds / count:.3f} |")
        evaluations_s = sum(evaluator.seconds.values())
        print(f"| all | {sum(evaluator.count.values())} | {evaluations_s:.1f} | |")
        print(f"\nthe rest, mostly evidence: {own - evaluations_s:.1f} s")
    print(f"wall {wall:.1f} s, processor time {own:.1f} s here, {workers:.1f} s in other processes")
    print(f"solver runs: {evaluator.counts.runs}; verdict: {result.diagnosis.verdict.kind}")


if __name__ == "__main__":
    main()
