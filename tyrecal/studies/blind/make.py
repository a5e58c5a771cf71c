"""Trials made: tyres drawn and computed, the truth sealed, measurements written alike."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import exp
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import Json, atomic_write, make_folder, refuse_link
from ...measured.measurement import CSV_COLUMNS
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.evaluate.pool import process_pool
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ..fit.targets import target_labels
from ..inference.uncertainties import sources
from .draw import SWAPPED_WITHIN, Truth, draw, tyre
from .maker import Computed, Maker
from .protocol import Protocol, read_json, write_json, write_protocol
from .ruler import write_ruler
from .seal import SEAL, seal

USUAL_LABELS = (
    Label(0, 0, "axial"),
    Label(0, 0, "torsional"),
    *(Label(c, m) for c in (1, 2, 3) for m in (1, 0)),
    Label(4, 0),
)
MAX_TRIES = 20  # tyres that a trial may draw until one has a solution


@dataclass(frozen=True)
class Trial:
    """A tyre as the maker computed it, without noise."""

    truth: Truth
    tries: int  # tyres drawn until one had a solution
    with_effect: dict[float, Computed]  # by pressure
    without: dict[float, Computed]


def make(
    folder: Path,
    sealed: Path,
    case: LoadedCase,
    protocol: Protocol,
    maker: Maker,
    ruler: Callable[[], Json],
    jobs: int = 1,
    seed: int | None = None,
    on_progress: Callable[[int, int], None] = lambda done, all: None,
) -> str:
    """Make trials in ``folder`` and their truth in ``sealed``; returns the seal's sha256.

    ruler: measures what tells how hard a trial is (`ruler.measure`), before anything is drawn;
    seed: None = a secret one, kept in ``sealed`` so that the same call draws the same tyres again,
    whose runs are in the maker's store. Raises InputError where the folder holds trials already,
    or the truth would lie in it.
    """
    if (folder / SEAL).exists():
        raise InputError(f"{folder} has sealed trials already; make others in another folder")
    if sealed.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"the truth must not be in {folder}, the folder of the trials")
    make_folder(folder)
    make_folder(sealed)
    for path in (*folder.rglob("*"), sealed / "record"):
        refuse_link(path)
    write_ruler(folder, ruler())
    seed = kept_seed(sealed, seed)
    own_sources, _ = sources(case)
    truths = draw(protocol, case, own_sources, maker.laws, maker.outside, seed)
    work = partial(_make, protocol, case, maker)
    trials: list[Trial] = []
    with process_pool(jobs) if jobs > 1 else nullcontext() as pool:
        for trial in (pool.map if pool else map)(work, truths):
            trials.append(trial)
            on_progress(len(trials), len(truths))
    copy_case(case, folder)
    write_protocol(folder, protocol)
    write_trials(folder, protocol, trials)
    return seal(
        folder, sealed, {"seed": seed, "trials": [sealed_trial(t, protocol) for t in trials]}
    )


def labels_of(case: LoadedCase) -> list[Label]:
    """The modes that are measured: the case's targets or, where it has none, those that a modal
    analysis of any tyre shows."""
    return target_labels(case) or list(USUAL_LABELS)


def values(trial: Trial, protocol: Protocol) -> dict[float, dict[Label, tuple[float, ...]]]:
    """Readings of the laboratory, Hz by pressure and label: noise, the tyre's own splits, labels.

    One member for [0,0], two for doublets in an order by chance; NaN where a value is missing.
    """
    random = np.random.default_rng(trial.truth.scatter)
    labels = list(next(iter(trial.with_effect.values())).ln_f)
    own = {label: protocol.split * random.normal() for label in labels}
    read: dict[float, dict[Label, tuple[float, ...]]] = {}
    for pressure in protocol.pressures_kPa:
        computed, here = trial.with_effect[pressure], {}
        for label in labels:
            low, high = computed.ln_f[label]
            pair = [low - own[label] / 2, high + own[label] / 2] if label.c else [low]
            noisy = np.exp(pair + protocol.noise * random.normal(size=len(pair)))
            here[label] = tuple(random.permutation(noisy).tolist())
        places = [(label, i) for label in labels for i in range(len(here[label]))]
        gone = random.choice(len(places), int(random.integers(protocol.missing + 1)), False)
        for label, i in (places[k] for k in gone):
            here[label] = tuple(float("nan") if j == i else f for j, f in enumerate(here[label]))
        read[pressure] = here
    if trial.truth.swapped:
        _swap(read, labels, random)
    return read


def _make(protocol: Protocol, case: LoadedCase, maker: Maker, truth: Truth) -> Trial:
    """The trial, its tyre drawn again where it has no solution."""
    own_sources, _ = sources(case)
    labels = labels_of(case)
    random = np.random.default_rng(truth.scatter + 1)
    law = {"effect": maker.laws, "outside": maker.outside, "none": {}}[truth.kind].get(truth.law)
    for tries in range(1, MAX_TRIES + 1):
        try:
            both = [
                {
                    p: maker.compute(tyre(truth, case, own_sources, p, each), labels)
                    for p in protocol.pressures_kPa
                }
                for each in ([law, None] if law else [None])
            ]
            if law and law.read:
                read = law.read({p: h.ln_f for p, h in both[0].items()}, truth.size)
                both[0] = {p: Computed(read[p], h.ln_mass) for p, h in both[0].items()}
            return Trial(truth, tries, both[0], both[-1])
        except (EvaluationFailed, ValueError) as failure:
            last = failure
        truth = _again(truth, case, protocol, random)
    raise InputError(f"no tyre with {truth.law or 'these constants'} has a solution: {last}")


def _again(
    truth: Truth, case: LoadedCase, protocol: Protocol, random: np.random.Generator
) -> Truth:
    """A trial like the given one with other design variables and constants."""
    rules, own_sources = replace(protocol, counts={"none": 1}), sources(case)[0]
    (other,) = draw(rules, case, own_sources, {}, {}, int(random.integers(2**63)))
    return replace(truth, variables=other.variables, constants=other.constants)


def _swap(
    read: Mapping[float, dict[Label, tuple[float, ...]]],
    labels: list[Label],
    random: np.random.Generator,
) -> None:
    """Two doublets of like frequency take each other's label at every pressure."""
    first = next(iter(read.values()))
    mean = {label: np.nanmean(first[label]) for label in labels if label.c}
    near = [
        (a, b)
        for a in mean
        for b in mean
        if a < b and abs(np.log(mean[a] / mean[b])) < SWAPPED_WITHIN
    ]
    if near:
        a, b = near[int(random.integers(len(near)))]
        for here in read.values():
            here[a], here[b] = here[b], here[a]


def write_trials(folder: Path, protocol: Protocol, trials: list[Trial]) -> None:
    """One CSV a trial, all of the same form, digits and time."""
    make_folder(folder / "trials")
    for trial in trials:
        lines = [",".join(CSV_COLUMNS)]
        read = values(trial, protocol)
        for p in protocol.given_kPa:
            for label, members in read[p].items():
                for i, f in enumerate(members, 1):
                    if np.isfinite(f):
                        member = i if len(members) > 1 else ""
                        mode = f"{label.c},{label.m},{label.kind or ''},{member}"
                        reading = f"{f:.3f},{protocol.noise * f:.3f}"
                        lines.append(f"frequency_Hz,{mode},{p:.0f},0,{reading}")
        random = np.random.default_rng(trial.truth.scatter + 2)
        mass = exp(trial.with_effect[protocol.given_kPa[0]].ln_mass)
        mass *= exp(protocol.mass * random.normal())
        lines.append(f"mass_kg,,,,,,,{mass:.3f},{protocol.mass * mass:.3f}")
        path = folder / "trials" / f"{trial.truth.id}.csv"
        with atomic_write(path) as partial:
            partial.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="")
    for path in (folder / "trials").iterdir():
        os.utime(path, (0, 0))


def plain_trial(trial: Trial) -> Json:
    """One trial without noise, for JSON."""
    tables = {}
    for key, computed in (("with_effect", trial.with_effect), ("without", trial.without)):
        tables[key] = [
            {
                "pressure_kPa": p,
                "ln_mass": each.ln_mass,
                "ln_f": {str(label): list(pair) for label, pair in each.ln_f.items()},
            }
            for p, each in computed.items()
        ]
    return {**asdict(trial.truth), "tries": trial.tries, **tables}


def sealed_trial(trial: Trial, protocol: Protocol) -> Json:
    """One trial of the truth, with what was held out as it was measured."""
    read = values(trial, protocol)[protocol.held_out_kPa]
    held_out = {
        str(label): [f for f in members if np.isfinite(f)] for label, members in read.items()
    }
    return {**plain_trial(trial), "held_out": held_out}


def kept_seed(sealed: Path, seed: int | None) -> int:
    """The seed of the sealed folder, which is drawn and kept at first. Raises InputError for
    another one."""
    path = sealed / "seed.json"
    if path.exists():
        known = int(read_json(path)["seed"])
        if seed is not None and seed != known:
            raise InputError(f"{path} has another seed; give another folder with --truth")
        return known
    seed = secrets.randbits(63) if seed is None else seed
    write_json(path, {"seed": seed})
    return seed


def copy_case(case: LoadedCase, folder: Path) -> None:
    """The case file and what it names, for who answers."""
    target = folder / "case"
    make_folder(target)
    shutil.copyfile(case.path, target / case.path.name)
    for path in case.files:
        copy = target / path.relative_to(case.folder)
        make_folder(copy.parent)
        shutil.copyfile(path, copy)
    if templates := case.case.templates:
        shutil.copytree(case.folder / templates, target / templates, dirs_exist_ok=True)
