"""Blind study 3, group by group: a size and whose section it is diagnosed with.

    python -m tests.blind.study3 groups
    python -m tests.blind.study3 make DIR 205_60r15_own --one_strong 30 --two 16 --jobs 2
    python -m tests.blind.study3 answer DIR 205_60r15_own --jobs 2
    python -m tests.blind.archive unpack DIR                 # all that is on record, truth beside
    python -m tests.blind.study3 score DIR > table.md        # of all answered, but LEARNED_FROM
    python -m tests.blind.study3 score DIR 11r22_5_own --least 1   # of one, few trials shown too
    python -m tests.blind.study3 score DIR --series 4 5 --least 1  # of two series together
    python -m tests.blind.study3 power DIR > table.md        # what could be found, by its rulers
    python -m tests.blind.study3 rises DIR > table.md        # how far laws are off over the run
    python -m tests.blind.study3 unlike DIR > table.md       # the makers' effects and ours
    python -m tests.blind.study3 mesh 205/60R15              # the maker's mesh error, and the model

Trials lie in DIR/GROUP, their truth in DIR-truth/GROUP. `make` and `answer` go on where they were
stopped; without --seed the seed is a secret, kept with the truth.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.blind.answer import answer, case_of, rows_of, tyre_model
from tyrecal.studies.blind.protocol import ANSWERS, SEAL, read_protocol
from tyrecal.studies.blind.ruler import read_ruler
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.tyre.effects.edit import changed, with_part

from ..answers import one_answer
from .cases import GROUPS, LABELS, LEARNED_FROM, Group, further, written
from .draw import NAMED_AS_A_RULE, Power, powers
from .make import FENICS, computed, make
from .score import scored
from .section import columns, mould
from .tables import misses, rises, table, table_of_rises, table_of_unlike, unlike
from .tyre import tyre_of

COUNTS = {"none": 12, "one": 12, "one_strong": 20, "two": 4, "two_strong": 14, "three": 4}
COUNTS |= {"three_strong": 0, "outside": 6, "outside_strong": 0, "again": 2}
COUNTS |= {"one_faint": 0, "one_weak": 0}
COMMANDS = "groups", "make", "answer", "score", "power", "rises", "unlike", "mesh"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", choices=COMMANDS)
    parser.add_argument("folder", nargs="?", help="DIR; of mesh the size")
    parser.add_argument("group", nargs="?")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--least", type=int)
    parser.add_argument("--series", type=int, nargs="+", default=())
    for kind, count in COUNTS.items():
        parser.add_argument(f"--{kind}", type=int, default=count)
    o = parser.parse_args()
    on_progress = lambda done, all: print(f"{done} of {all}", file=sys.stderr, flush=True)
    groups = {group.name: group for group in GROUPS}
    if o.what == "groups":
        print("\n".join(groups))
    elif o.what == "mesh":
        mesh(o.folder)
    elif o.what == "power":
        print(power(Path(o.folder)))
    elif o.what in ("rises", "unlike"):
        answered = [g for g in GROUPS if (Path(o.folder) / g.name / ANSWERS).exists()]
        wanted = [g for g in answered if not o.series or g.series in o.series]
        places = {g: (Path(o.folder) / g.name, sealed_in(o.folder) / g.name) for g in wanted}
        if o.what == "rises":
            print(table_of_rises({g: rises(*place) for g, place in places.items()}))
        else:
            print(table_of_unlike((g, unlike(*place)) for g, place in places.items()))
    elif o.what == "score":
        print(result(Path(o.folder), o.group, o.least, o.series))
    else:
        folder, sealed = Path(o.folder) / o.group, sealed_in(o.folder) / o.group
        if o.what == "make":
            counts = {kind: getattr(o, kind) for kind in COUNTS}
            print(make(folder, sealed, groups[o.group], counts, o.jobs, o.seed, on_progress))
        else:
            case, protocol = case_of(folder), read_protocol(folder)
            model = tyre_model(case, Evaluator(TyreDesign(case)), protocol, o.jobs)
            one = partial(one_answer, further=further(protocol.counts))
            print(answer(folder, model, rows_of(case, protocol), o.jobs, on_progress, one))


def sealed_in(folder: str) -> Path:
    """Where the truth of all groups lies."""
    return Path(folder).with_name(f"{Path(folder).name}-truth")


def result(
    folder: Path, group: str | None = None, least: int | None = None, together: Sequence[int] = ()
) -> str:
    """Tables of all series whose groups are answered, but for the one that was learned from, or of
    one group, or of the series ``together`` as if they were one; least: see `table`."""
    wanted = [g for g in GROUPS if (g.name == group if group else g.name != LEARNED_FROM)]
    counted = [g for g in wanted if (folder / g.name / ANSWERS).exists()]
    parts = ["# Blind study 3, as it was answered", ""]
    for series in [together] if together else [(n,) for n in sorted({g.series for g in counted})]:
        scores = {
            g: scored(folder / g.name, sealed_in(str(folder)) / g.name)
            for g in counted
            if g.series in series
        }
        names = ", ".join(g.name for g in scores)
        parts += [
            f"## Series {' and '.join(map(str, series))}",
            "",
            f"{names}.",
            "",
            table(scores, least),
            misses(scores),
            "",
        ]
    return "\n".join(parts).rstrip()


def power(folder: Path) -> str:
    """lambda of each effect at the far end of its range, by group, from the tyres' rulers; in
    parentheses where that is too little to be named as a rule."""
    by_group = {}
    for group in (g for g in GROUPS if (folder / g.name / SEAL).exists()):
        trials = folder / group.name
        ruler = read_ruler(trials)
        by_group[group] = {each.id: each for each in powers(ruler, read_protocol(trials))}
    ids = sorted(set[str]().union(*by_group.values()), key=lambda id: -lambdas(by_group, id)[0])
    heads = [f"{group.size} {'own' if group.own else 'foreign'}" for group in by_group]
    lines = [f"| effect | {' | '.join(heads)} |", "|---" * (1 + len(heads)) + "|"]
    for id in ids:
        cells = [
            f"{x:.0f}" if x >= NAMED_AS_A_RULE else f"({x:.0f})" for x in lambdas(by_group, id)
        ]
        lines.append(f"| {id} | {' | '.join(cells)} |")
    return "\n".join(lines)


def lambdas(by_group: Mapping[Group, Mapping[str, Power]], id: str) -> list[float]:
    """By group; 0 where it was not weighed."""
    return [each[id].full if id in each else 0.0 for each in by_group.values()]


def mesh(size: str) -> None:
    """Print, in per cent, how far the mould's modes at the group's second pressure are above those
    with elements half as long, and how far the model's modes with this section are above the
    mould's."""
    group = next(g for g in GROUPS if g.size == size)
    with TemporaryDirectory() as folder:
        case = written(replace(group, own=True), Path(folder))
    pressure, ln_f = group.given_kPa[1], []
    for times in (1, 2):
        tyre = tyre_of(case, mould(size), columns(mould(size), times))
        (state,) = computed(FENICS, tyre, [pressure], LABELS).values()
        ln_f.append(np.array([state.ln_f[label][0] for label in LABELS]))
    FENICS.close()
    off = {"elements half as long": ln_f[0] - ln_f[1]}
    for holds in ("whole_bead", "bead_surface"):
        held = changed(case, rim=with_part(case.case.rim, holds=holds))
        model = TyreModel(
            held, Evaluator(TyreDesign(held)), [(label, pressure) for label in LABELS], [], {}
        )
        off[f"model, {holds.replace('_', ' ')}"] = model.values_at(model.start) - ln_f[0]
    print(f"| size, {pressure:g} kPa | what | " + " | ".join(map(str, LABELS)) + " |")
    print("|---" * (2 + len(LABELS)) + "|")
    for what, shift in off.items():
        print(f"| {size} | {what} | " + " | ".join(f"{100 * x:+.2f}" for x in shift) + " |")


if __name__ == "__main__":
    main()
