"""CalculiX for the blind trials: an emulator, trained and confirmed by its own runs.

    python -m tests.studies.blind_calculix train 40       # runs CalculiX, goes on where it stopped
    python -m tests.studies.blind_calculix confirm 30     # runs with effects, by the makers' laws
    python -m tests.studies.blind_calculix again          # the common problem of all runs anew
    python -m tests.studies.blind_calculix table > table.md
    python -m tests.studies.blind_calculix make DIR 450 200 80 [SEED]     # the trials themselves

    ln f_CalculiX = ln f_common + sum_k a_k q_k(x, p)

f_common: the bundled solver on the common problem (`calculix.common`) with the same mesh, which is
not the one that the diagnosis uses; q_k: 1 and the logarithms of the design variables and of the
pressure. Effects enter by f_common alone, the difference being smooth and small. One line of JSON
a run in RECORD. A run with a mode that is OUTLIER off the median of all is left out: there CalculiX
found another state.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from tyrecal.simulate.deck.calculix import PLY_THICKNESS_M
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.modes.find import match
from tyrecal.simulate.modes.label import Label, label_modes
from tyrecal.studies.blind.answer import rows_of, tyre_model
from tyrecal.studies.blind.make import Truth, draw, make, tyre
from tyrecal.studies.blind.maker import OUTSIDE_FAMILIES, Computed, EffectLaw, Maker
from tyrecal.studies.blind.protocol import Protocol
from tyrecal.studies.blind.ruler import measure
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.case import LoadedCase, number_at, start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values

from ..blind.laws import other_laws
from ..effects.support import exact
from .calculix import common, modes_of, split

Array = np.ndarray
ROOT = Path(__file__).parents[2]
RECORD = Path(__file__).parents[1] / "benchmarks" / "blind_calculix.jsonl"
ELEMENTS = {"crown": 10, "upper_sidewall": 9, "lower_sidewall": 9, "bead": 2}  # not the default
JOBS = 2
BOX = 0.38  # of ln of each variable: 40 %, and what a constant is worth
PRESSURES_kPa = (157.0, 323.0)


def meshed(case: LoadedCase) -> LoadedCase:
    """The case with the maker's own mesh."""
    level = case.case.mesh.levels["default"].model_copy(update={"elements": ELEMENTS})
    mesh = case.case.mesh.model_copy(update={"levels": {"default": level}, "level": "default"})
    return replace(case, case=case.case.model_copy(update={"mesh": mesh}))


@cache
def base() -> LoadedCase:
    """The tyre of the trials."""
    return meshed(exact(load_case(ROOT / "cases" / "p235_75r17.yaml")))


def training(count: int) -> list[dict[str, float]]:
    """Designs and pressures, a Halton sequence: the first ones stay when more are wanted."""
    start = start_values(base())
    points = qmc.Halton(4, seed=5).random(count)
    low, high = PRESSURES_kPa
    return [
        {
            **{
                name: value * float(np.exp(BOX * (2 * u - 1)))
                for (name, value), u in zip(start.items(), p[:3], strict=True)
            },
            "pressure_kPa": float(low + (high - low) * p[3]),
        }
        for p in points
    ]


def common_problem(case: LoadedCase, faces_at: frozenset[str] = frozenset()) -> LoadedCase:
    """The case as `calculix.split` makes it, with effects and gauges written into its section."""
    tyre = resolved(case)
    c = tyre.case
    plain = c.model_copy(update={"section": c.section.model_copy(update={"gauges": None})})
    case = replace(tyre.written, case=plain, drawn=tyre.gauged)
    return split(case, PLY_THICKNESS_M, faces_at)


def bundled(case: LoadedCase, labels: list[Label]) -> tuple[dict[str, float], float]:
    """ln f by label on the common problem, and the tyre's mass in kg. Raises EvaluationFailed.

    The row of elements that a border of two rubbers needs at a ply is worth 0.03 %, which
    CalculiX's mesh does not have: it is taken off as it is found with one rubber.
    """
    known, mass_kg = _solved(common_problem(case), labels)
    solids = case.case.solids
    borders = frozenset(name for solid in solids for name in solid.between or ())
    if borders:
        one = {"solids": [solid for solid in solids if not solid.between]}
        plain = replace(case, case=case.case.model_copy(update=one))
        rowless = _solved(common_problem(plain), labels)[0]
        rowed = _solved(common_problem(plain, borders), labels)[0]
        known = {key: value + rowless[key] - rowed[key] for key, value in known.items()}
    return known, mass_kg


def _solved(case: LoadedCase, labels: list[Label]) -> tuple[dict[str, float], float]:
    """The same of ``case`` as it stands, with CalculiX's cord law and straight sides."""
    with common():
        for count in (None, 4):
            answer = Evaluator(TyreDesign(case), "bundled").evaluate(Question({}, (), count))
            try:
                matched = match(label_modes(answer.modes), labels)
            except EvaluationFailed as lost:
                failure = lost
                continue
            return {str(x): float(np.log(matched[x].frequency_Hz)) for x in labels}, answer.mass_kg
    raise failure


def targets(case: LoadedCase) -> list[Label]:
    """The modes that are measured."""
    assert case.case.targets is not None
    return [Label(t.c, t.m, t.kind) for t in case.case.targets.modes]


def calculix(case: LoadedCase) -> dict[str, float]:
    """ln f by label, CalculiX itself. Raises EvaluationFailed."""
    return {key: float(np.log(m.frequency_Hz)) for key, m in modes_of(case, "calculix").items()}


def run(case: LoadedCase, about: Mapping[str, Any]) -> None:
    """Record one run of both solvers."""
    try:
        entry = {**about, "calculix": calculix(case), "common": bundled(case, targets(case))[0]}
    except EvaluationFailed as failure:
        entry = {**about, "failed": str(failure)}
    with RECORD.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")
    print(entry.get("failed") or entry["about"], flush=True)


def recorded(kind: str) -> list[dict[str, Any]]:
    """Runs on record of a kind, in the order in which they were made."""
    if not RECORD.exists():
        return []
    entries = [json.loads(line) for line in RECORD.read_text(encoding="utf-8").splitlines()]
    return [entry for entry in entries if entry["about"] == kind]


def train(count: int) -> None:
    """Make the runs that are not on record."""
    known = [entry["values"] for entry in recorded("train")]
    for values in training(count):
        if values not in known:
            run(with_values(base(), values), {"about": "train", "values": values})


def laws_confirmed() -> dict[str, EffectLaw]:
    """Laws that CalculiX confirms: all laws and families except errors of reading."""
    known = {**other_laws(frozenset({"modes"})), **OUTSIDE_FAMILIES}
    return {name: law for name, law in known.items() if not law.read}


def confirm(count: int) -> None:
    """Make runs with effects and families, of drawn size, on drawn tyres, those first that have
    the fewest, until there are ``count``."""
    case, laws = base(), laws_confirmed()
    own_sources, _ = sources(case)
    names = [e["law"] for e in recorded("confirm")]
    done = {name: names.count(name) for name in sorted(laws)}
    for i in range(len(names), len(names) + max(0, count - sum(done.values()))):
        name = min(done, key=lambda name: (done[name], name))
        done[name] += 1
        rules = Protocol("", "", {"effect": 1})
        (truth,) = draw(rules, case, own_sources, {name: laws[name]}, {}, 1000 + i)
        pressure = float(np.random.default_rng(i).choice(rules.pressures_kPa))
        about = {"about": "confirm", "law": name, "size": truth.size, "pressure_kPa": pressure}
        about["variables"], about["constants"] = truth.variables, truth.constants
        run(tyre(truth, case, own_sources, pressure, laws[name]), about)


def again() -> None:
    """Solve the common problem of every run on record anew, after a change to it."""
    entries = [json.loads(line) for line in RECORD.read_text(encoding="utf-8").splitlines()]
    case, laws = base(), laws_confirmed()
    own_sources, _ = sources(case)
    for entry in (entry for entry in entries if "failed" not in entry):
        if entry["about"] == "train":
            made = with_values(case, entry["values"])
        else:
            truth = Truth(
                "",
                "",
                entry["law"],
                entry["size"],
                entry["variables"],
                entry["constants"],
                0,
                False,
            )
            made = tyre(truth, case, own_sources, entry["pressure_kPa"], laws[entry["law"]])
        entry["common"] = bundled(made, targets(made))[0]
    RECORD.write_text("".join(json.dumps(e) + "\n" for e in entries), encoding="utf-8")


OUTLIER = 0.0005  # of ln f
# the turned-up ply is in compression at low pressure, near a limit point, where the solvers' cord
# laws part by more than the form error on record: seen in trials made for development
LEFT_OUT = {"carcass_turn_up"}


def features(variables: Mapping[str, float], pressure_kPa: float) -> Array:
    """q_k (5,)."""
    start = start_values(base())
    x = [np.log(variables[n] / v) / BOX for n, v in start.items()]
    return np.array([1.0, *x, np.log(pressure_kPa / 240.0)])


Runs = list[dict[str, Any]]


def usual(runs: Runs) -> tuple[Runs, list[str]]:
    """Runs without outliers, and those that have some, in words."""
    runs = [entry for entry in runs if "failed" not in entry]
    off = np.array([[e["calculix"][k] - e["common"][k] for k in runs[0]["calculix"]] for e in runs])
    worst = abs(off - np.median(off, axis=0)).max(1)
    out = [
        f"run {i + 1}, {100 * worst[i]:.2f} % from the others"
        for i in np.flatnonzero(worst > OUTLIER)
    ]
    return [e for e, w in zip(runs, worst, strict=True) if w <= OUTLIER], out


def fitted(runs: Runs) -> dict[str, Array]:
    """a (5,) by mode."""
    q = np.array([features(e["values"], e["values"]["pressure_kPa"]) for e in runs])
    return {
        key: np.linalg.lstsq(
            q, np.array([e["calculix"][key] - e["common"][key] for e in runs]), rcond=None
        )[0]
        for key in runs[0]["calculix"]
    }


class EmulatedCalculix(Maker):
    """CalculiX C3D20R, as this module emulates it."""

    def __init__(self) -> None:
        about = (
            "CalculiX 2.20 (C3D20R, St Venant-Kirchhoff cords, plies of 0.2 mm, another mesh) by an"
            " emulator, effects by other laws than the catalogue's"
        )
        known = other_laws(frozenset({"modes"}))
        laws = {id: law for id, law in known.items() if id not in LEFT_OUT}
        super().__init__(about, "", laws, OUTSIDE_FAMILIES)
        self._fitted = fitted(usual(recorded("train"))[0])

    def compute(self, case: LoadedCase, labels: list[Label]) -> Computed:
        """``case``: of `base`, whose mesh a law may have divided. Raises EvaluationFailed."""
        known, mass = bundled(case, labels)
        layers = case.case.rebar_layers
        carcass = next(layer for name, layer in layers.items() if name.startswith("carcass"))
        values = {
            "A_belt": layers["belt_1"].area_m2,
            "A_carcass": carcass.area_m2,  # of the first of several, where the cords fan out
            "C10": number_at(case, "materials.rubber.C10_Pa"),
        }
        q = features(values, case.case.pressure_kPa)
        ln_f = {x: known[str(x)] + float(q @ self._fitted[str(x)]) for x in labels}
        return Computed({x: (f, f) for x, f in ln_f.items()}, float(np.log(mass)))


def table() -> None:
    """Print the results in Markdown."""
    runs, out = usual(recorded("train"))
    a = fitted(runs)
    print(f"{len(runs)} runs of training; left out: {', '.join(out) or 'none'}.\n")
    print("| mode | mean difference, % | largest error on a run that was left out of the fit, % |")
    print("|---|---|---|")
    errors: dict[str, list[float]] = {key: [] for key in a}
    for e in runs:
        b = fitted([other for other in runs if other is not e])
        q = features(e["values"], e["values"]["pressure_kPa"])
        for key in a:
            errors[key].append(float(e["calculix"][key] - e["common"][key] - q @ b[key]))
    for key in a:
        print(f"| {key} | {100 * a[key][0]:+.3f} | {100 * max(map(abs, errors[key])):.4f} |")
    print("\n| law | size | kPa | largest error of the emulator, % | in |\n|---|---|---|---|---|")
    known = laws_confirmed()
    for e in (e for e in recorded("confirm") if e["law"] in known):
        where = f"| {e['law']} | {e['size']:.3g} | {e['pressure_kPa']:g}"
        if "failed" in e:
            print(f"{where} | {e['failed']} | |")
            continue
        off = {
            key: e["calculix"][key]
            - e["common"][key]
            - features(e["variables"], e["pressure_kPa"]) @ a[key]
            for key in a
        }
        worst = max(off, key=lambda key: abs(off[key]))
        print(f"{where} | {100 * off[worst]:+.4f} | {worst} |")


def main() -> None:
    what, *rest = sys.argv[1:]
    if what == "train":
        train(int(rest[0]))
    elif what == "confirm":
        confirm(int(rest[0]))
    elif what == "again":
        again()
    elif what == "table":
        table()
    elif what == "make":
        folder, maker = Path(rest[0]), EmulatedCalculix()
        counts = dict(zip(("effect", "none", "outside"), map(int, rest[1:4]), strict=True))
        case = base()
        protocol = Protocol(maker.about, case.path.name, counts)
        seed = int(rest[4]) if len(rest) > 4 else None
        on_progress = lambda done, all: print(f"{done} of {all}", file=sys.stderr)
        sealed = folder.with_name(f"{folder.name}-truth")
        plain = load_case(case.path)
        ruler = lambda: measure(
            tyre_model(plain, Evaluator(TyreDesign(plain)), protocol), rows_of(plain, protocol)
        )
        print(make(folder, sealed, case, protocol, maker, ruler, JOBS, seed, on_progress))


if __name__ == "__main__":
    main()
