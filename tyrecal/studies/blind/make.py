"""Trials made: tyres drawn and computed, the truth sealed, measurements written alike."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from math import exp, log1p
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import Json, make_folder, refuse_link, write_text
from ...measured.measurement import Measurement, measurements_csv
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.evaluate.pool import process_pool
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase, start_values
from ...tyre.number_units import EFFECT_PATH
from ...tyre.values import with_values
from ..fit.targets import labels_to_measure
from ..inference.section_fields import with_fields
from ..inference.uncertainties import Source, sources, values_of
from .maker import Computed, EffectLaw, Maker
from .protocol import SEAL, Protocol, read_json, seal, write_json, write_protocol
from .ruler import RULER_FILE

MAX_TRIES = 20  # tyres that a trial may draw until one has a solution
SWAPPED_WITHIN = 0.25  # relative distance of modes whose labels could be taken for one another


@dataclass(frozen=True)
class Truth:
    """One tyre."""

    id: str  # random
    kind: str  # effect, none or outside
    law: str  # id of the effect, or name of the family outside the catalogue, "" for none
    size: float  # its parameter, in the unit of the law
    variables: dict[str, float]  # by name, in their own units
    constants: dict[str, float]  # in standard deviations
    scatter: int  # seed of noise, missing values, splits of pairs and order of their modes
    swapped: bool  # whether two labels are exchanged in its data


def draw(
    protocol: Protocol,
    case: LoadedCase,
    sources: Sequence[Source],
    laws: Mapping[str, EffectLaw],
    outside: Mapping[str, EffectLaw],
    seed: int,
) -> list[Truth]:
    """All trials, in the order of their ids, which reveals nothing.

    Effects and families have equal chances, sizes are uniform over ``smallest`` to 1 of the range,
    on either side where it has two. Variables are log-uniform within a factor 1 + ``spread`` of
    their starts; ``swapped`` is the probability that labels are exchanged.
    """
    random = np.random.default_rng(seed)
    kinds = [kind for kind, count in protocol.counts.items() for _ in range(count)]
    truths = []
    for kind in kinds:
        known = {"effect": laws, "outside": outside, "none": {}}[kind]
        law = str(random.choice(sorted(known))) if known else ""
        size = known[law].drawn(random, protocol.smallest) if law else 0.0
        width, id = log1p(protocol.spread), random.bytes(6).hex()
        variables = {
            name: value * float(np.exp(random.uniform(-width, width)))
            for name, value in start_values(case).items()
        }
        constants = {source.name: float(random.normal()) for source in sources}
        scatter, swapped = int(random.integers(2**63)), bool(random.random() < protocol.swapped)
        truths.append(Truth(id, kind, law, size, variables, constants, scatter, swapped))
    return sorted(truths, key=lambda truth: truth.id)


def tyre(
    truth: Truth,
    case: LoadedCase,
    sources: Sequence[Source],
    pressure_kPa: float,
    law: EffectLaw | None,
) -> LoadedCase:
    """The case as this tyre is at a stated pressure, with ``law``'s effect or without.

    Raises ValueError where no such tyre can be.
    """
    plain = {**values_of(case, list(sources)), "pressure_kPa": pressure_kPa}
    values: dict[str, float] = dict(truth.variables)
    for source in sources:
        for path, step in source.steps.items():  # by one standard deviation
            known = values.get(path, 0.0 if path.startswith(EFFECT_PATH) else plain[path])
            values[path] = known + truth.constants[source.name] * step
    values.setdefault("pressure_kPa", pressure_kPa)
    made = with_fields(with_values(case, values), truth.constants)
    return law.add(made, truth.size) if law else made


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
    write_json(folder / RULER_FILE, ruler())
    seed = kept_seed(sealed, seed)
    truths = draw(protocol, case, sources(case)[0], maker.laws, maker.outside, seed)
    work = partial(_make, protocol, case, maker)
    trials: list[Trial] = []
    with process_pool(jobs) if jobs > 1 else nullcontext() as pool:
        for trial in (pool.map if pool else map)(work, truths):
            trials.append(trial)
            on_progress(len(trials), len(truths))
    copy_case(case, folder)
    write_protocol(folder, protocol)
    write_trials(folder, protocol, trials)
    truth = [sealed_trial(trial, protocol) for trial in trials]
    return seal(folder, sealed, {"seed": seed, "trials": truth})


def readings(trial: Trial, protocol: Protocol) -> list[Measurement]:
    """Readings of the laboratory at all pressures: with noise, the tyre's own splits and gaps.

    One member for [0,0], two for doublets in an order by chance.
    """
    random = np.random.default_rng(trial.truth.scatter)
    labels = list(next(iter(trial.with_effect.values())).ln_f)
    own = {label: protocol.split * random.normal() for label in labels}
    read = []
    for pressure in protocol.pressures_kPa:
        here = []
        for label in labels:
            low, high = trial.with_effect[pressure].ln_f[label]
            pair = [low - own[label] / 2, high + own[label] / 2] if label.c else [low]
            noisy = np.exp(pair + protocol.noise * random.normal(size=len(pair)))
            for i, f in enumerate(random.permutation(noisy).tolist(), 1):
                member, sigma = str(i) if label.c else "", protocol.noise * f
                here += [Measurement("frequency_Hz", label, member, pressure, 0.0, f, sigma)]
        gone = random.choice(len(here), int(random.integers(protocol.missing + 1)), False)
        read += [each for i, each in enumerate(here) if i not in gone]
    return _swapped(read, labels, random) if trial.truth.swapped else read


def _swapped(
    read: list[Measurement], labels: list[Label], random: np.random.Generator
) -> list[Measurement]:
    """The readings in their order, two doublets of like frequency with each other's label at every
    pressure."""
    pressures = list(dict.fromkeys(each.pressure_kPa for each in read))
    first: dict[Label, list[float]] = {}
    for each in read:
        if each.label and each.label.c and each.pressure_kPa == pressures[0]:
            first.setdefault(each.label, []).append(each.value)
    ln = {label: np.log(np.mean(values)) for label, values in first.items()}
    near = [(a, b) for a in ln for b in ln if a < b and abs(ln[a] - ln[b]) < SWAPPED_WITHIN]
    if not near:
        return read
    a, b = near[int(random.integers(len(near)))]
    other: dict[Label | None, Label] = {a: b, b: a}
    read = [replace(each, label=other.get(each.label, each.label)) for each in read]
    order = list(product(pressures, map(str, labels)))
    return sorted(read, key=lambda each: order.index((each.pressure_kPa, str(each.label))))


def _make(protocol: Protocol, case: LoadedCase, maker: Maker, truth: Truth) -> Trial:
    """The trial, its tyre drawn again where it has no solution."""
    own_sources, labels = sources(case)[0], labels_to_measure(case)
    random = np.random.default_rng(truth.scatter + 1)
    law = {**maker.laws, **maker.outside}.get(truth.law)
    compute = lambda truth, p, law: maker.compute(tyre(truth, case, own_sources, p, law), labels)
    for tries in range(1, MAX_TRIES + 1):
        try:
            both = [
                {p: compute(truth, p, each) for p in protocol.pressures_kPa}
                for each in ([law, None] if law else [None])
            ]
            if law and law.read:
                read = law.read({p: h.ln_f for p, h in both[0].items()}, truth.size)
                both[0] = {p: Computed(read[p], h.ln_mass) for p, h in both[0].items()}
            return Trial(truth, tries, both[0], both[-1])
        except (EvaluationFailed, ValueError) as failure:
            last = failure
        rules = replace(protocol, counts={"none": 1})
        (other,) = draw(rules, case, own_sources, {}, {}, int(random.integers(2**63)))
        truth = replace(truth, variables=other.variables, constants=other.constants)
    raise InputError(f"no tyre with {truth.law or 'these constants'} has a solution: {last}")


def write_trials(folder: Path, protocol: Protocol, trials: list[Trial]) -> None:
    """One CSV a trial, all of the same form and time."""
    make_folder(folder / "trials")
    for trial in trials:
        read = [x for x in readings(trial, protocol) if x.pressure_kPa in protocol.given_kPa]
        random = np.random.default_rng(trial.truth.scatter + 2)
        mass = exp(trial.with_effect[protocol.given_kPa[0]].ln_mass)
        mass *= exp(protocol.mass * random.normal())
        read.append(Measurement("mass_kg", None, "", 0.0, 0.0, mass, protocol.mass * mass))
        path = folder / "trials" / f"{trial.truth.id}.csv"
        write_text(path, measurements_csv(read))
        os.utime(path, (0, 0))


def plain_trial(trial: Trial) -> Json:
    """One trial without noise, for JSON."""
    tables = {"with_effect": trial.with_effect, "without": trial.without}
    plain = {
        key: [{"pressure_kPa": p, **each.plain()} for p, each in table.items()]
        for key, table in tables.items()
    }
    return {**asdict(trial.truth), "tries": trial.tries, **plain}


def sealed_trial(trial: Trial, protocol: Protocol) -> Json:
    """One trial of the truth, with what was held out as it was measured."""
    held_out: dict[str, list[float]] = {}
    for each in readings(trial, protocol):
        if each.pressure_kPa == protocol.held_out_kPa:
            held_out.setdefault(str(each.label), []).append(each.value)
    return {**plain_trial(trial), "held_out": held_out}


def kept_seed(sealed: Path, seed: int | None) -> int:
    """The seed of the sealed folder, which is drawn and kept at first. Raises InputError for
    another one."""
    path = sealed / "seed.json"
    if not path.exists():
        write_json(path, {"seed": secrets.randbits(63) if seed is None else seed})
    known = int(read_json(path)["seed"])
    if seed not in (None, known):
        raise InputError(f"{path} has another seed; give another folder with --truth")
    return known


def copy_case(case: LoadedCase, folder: Path) -> None:
    """The case file and what it names, for who answers."""
    target = folder / "case"
    for path in (case.path, *case.files):
        copy = target / path.relative_to(case.folder)
        make_folder(copy.parent)
        shutil.copyfile(path, copy)
    if templates := case.case.templates:
        shutil.copytree(case.folder / templates, target / templates, dirs_exist_ok=True)
