"""Study 3's trials: tyres drawn, computed by FEniCSx, sealed, measured alike. A group at a time.
One process of FEniCSx answers many tyres."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import asdict, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.pool import process_pool
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode
from tyrecal.simulate.modes.find import match
from tyrecal.simulate.modes.label import Label, label_modes
from tyrecal.studies.blind.answer import rows_of, tyre_model
from tyrecal.studies.blind.make import (
    MAX_TRIES,
    Trial,
    Truth,
    copy_case,
    kept_seed,
    plain_trial,
    sealed_trial,
    write_trials,
)
from tyrecal.studies.blind.maker import Computed
from tyrecal.studies.blind.protocol import (
    SEAL,
    Protocol,
    read_json,
    seal,
    write_json,
    write_protocol,
)
from tyrecal.studies.blind.ruler import RULER_FILE, Ruler, measure, read_ruler
from tyrecal.tyre.case import LoadedCase

from ...studies.judge import PYTHON
from .cases import LABELS, Group, further, written
from .draw import FORESEEN, Drawn, drawn, drawn_anew, evident, made
from .tyre import Tyre, problem

ROOT = Path(__file__).parents[3]
ABOUT = (
    "FEniCSx 0.5.2, cubic triangles, cords by their nominal strain, ln^2 J / D1, viscous shear from"
    " the inflated state; sections by arcs with real parts, effects by laws of their own"
)


class Fenics:
    """A process of Debian's Python; started when it is first asked."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Raises EvaluationFailed; InputError where FEniCSx is missing."""
        if self._process is None or self._process.poll() is not None:
            self._process = subprocess.Popen(
                [PYTHON, "-m", "tests.blind.study3.solve"],
                cwd=ROOT,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise InputError("FEniCSx does not answer: apt-get install python3-dolfinx")
        answer: dict[str, Any] = json.loads(line)
        if "failed" in answer:
            raise EvaluationFailed("no_equilibrium", answer["failed"])
        return answer

    def close(self) -> None:
        """End the process."""
        if self._process and self._process.stdin:
            self._process.stdin.close()
            self._process.wait()
            self._process = None


def modes(answer: dict[str, Any], state: dict[str, Any], labels: list[Label]) -> dict[Label, float]:
    """Hz by label. Raises EvaluationFailed where one is lost or the state is unstable."""
    half = np.array(answer["points"])
    points = np.concatenate([half, half * [1, -1]])
    raw = []
    for mode in state["modes"]:
        if mode["eigenvalue"] <= 0:
            raise EvaluationFailed("unstable", f"{mode['eigenvalue']:g} of n = {mode['n']}")
        own = np.array(mode["cos"]) + 1j * np.array(mode["sin"])
        # (theta, z) -> (-theta, -z): u_r as it is, u_theta and u_z with the other sign
        both = np.concatenate([own, own.conj() * [1, -1, -1]])
        shape = HarmonicShape(mode["n"], np.arange(len(points)), points, both)
        raw.append(
            RawMode(float(np.sqrt(mode["eigenvalue"]) / (2 * np.pi)), shape, 1 + bool(mode["n"]))
        )
    return {label: mode.frequency_Hz for label, mode in match(label_modes(raw), labels).items()}


def computed(
    fenics: Fenics, tyre: Tyre, pressures_kPa: list[float], labels: list[Label], near: bool = False
) -> dict[float, Computed]:
    """By pressure, without noise; near: nearly the tyre asked before. Raises EvaluationFailed,
    ValueError."""
    answer = fenics.ask({**problem(tyre, pressures_kPa), "near": near})
    by_pressure = {}
    for p, state in zip(pressures_kPa, answer["states"], strict=True):
        ln_f = {label: float(np.log(f)) for label, f in modes(answer, state, labels).items()}
        by_pressure[p] = Computed(
            {x: (f, f) for x, f in ln_f.items()}, float(np.log(answer["mass_kg"]))
        )
    return by_pressure


FENICS = Fenics()  # of this process
Members = dict[str, dict[float, Computed]]
Made = tuple[Trial, dict[str, float], Members]
"""A trial, its effects' sizes, and the same tyre without each of several in turn."""


def make(
    folder: Path,
    sealed: Path,
    group: Group,
    counts: Mapping[str, int],
    jobs: int = 1,
    seed: int | None = None,
    on_progress: Callable[[int, int], None] = lambda done, all: None,
    ruler: Callable[[LoadedCase, Protocol], Mapping[str, Any]] | None = None,
) -> str:
    """The group's trials in ``folder`` and their truth in ``sealed``; returns the seal's sha256.
    Goes on where it was stopped. Raises InputError."""
    if (folder / SEAL).exists():
        raise InputError(f"{folder} holds sealed trials already; make others in another folder")
    further(counts)  # or nobody could answer
    folder.mkdir(parents=True, exist_ok=True)
    sealed.mkdir(parents=True, exist_ok=True)
    case = written(group, sealed)
    protocol = Protocol(
        ABOUT,
        case.path.name,
        dict(counts),
        given_kPa=group.given_kPa,
        held_out_kPa=group.held_out_kPa,
    )
    if not (folder / RULER_FILE).exists():
        write_json(folder / RULER_FILE, (ruler or partial(measured, jobs=jobs))(case, protocol))
    seed = kept_seed(sealed, seed)
    judged = any(counts.get(kind) for kind in (*FORESEEN, "outside_strong"))
    known = read_ruler(folder) if judged else None
    every = drawn(protocol, case, group, counts, seed, known)
    work = partial(one, sealed, protocol, case, group, known)
    results = []
    with process_pool(jobs) if jobs > 1 else nullcontext() as pool:
        for each in (pool.map if pool else map)(work, every):
            results.append(each)
            on_progress(len(results), len(every))
    FENICS.close()
    copy_case(case, folder)
    write_protocol(folder, protocol)
    write_trials(folder, protocol, [trial for trial, *_ in results])
    truth = [
        {
            **sealed_trial(trial, protocol),
            "effects": effects,
            "mounting": each.mounting,
            "again": each.again,
            "members": shifts(trial, members),
        }
        for each, (trial, effects, members) in zip(every, results, strict=True)
    ]
    return seal(folder, sealed, {"seed": seed, "group": asdict(group), "trials": truth})


def measured(case: LoadedCase, protocol: Protocol, jobs: int = 1) -> Mapping[str, Any]:
    """The ruler, by the diagnosis' own model."""
    model = tyre_model(case, Evaluator(TyreDesign(case)), protocol, jobs)
    return measure(model, rows_of(case, protocol))


def one(
    sealed: Path,
    protocol: Protocol,
    case: LoadedCase,
    group: Group,
    ruler: Ruler | None,
    each: Drawn,
) -> Made:
    """A trial as it was made before it was stopped, or made now."""
    request = json.dumps([asdict(each), asdict(group), protocol.maker], sort_keys=True)
    path = sealed / "made" / f"{sha256(request.encode()).hexdigest()[:16]}.json"
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        trial, effects, members = _made(protocol, case, group, ruler, each)
        others = {
            id: plain_trial(replace(trial, without=c))["without"] for id, c in members.items()
        }
        write_json(path, {"trial": plain_trial(trial), "effects": effects, "members": others})
    content = read_json(path)
    trial = read_trial(dict(content["trial"]), LABELS)
    members = {
        id: read_trial({**content["trial"], "without": table}, LABELS).without
        for id, table in content["members"].items()
    }
    return trial, content["effects"], members


def _made(
    protocol: Protocol, case: LoadedCase, group: Group, ruler: Ruler | None, each: Drawn
) -> Made:
    """Its tyre drawn again where it has no solution, or what should be evident is not."""
    pressures = list(protocol.pressures_kPa)
    run = lambda *without: computed(
        FENICS, made(each, case, group, without), pressures, LABELS, near=bool(without)
    )
    last: Exception | str = ""
    for tries in range(1, MAX_TRIES + 1):
        try:
            whole = run()
            ids = sorted(each.effects)
            members = {id: run(id) for id in ids} if len(ids) > 1 else {}
            trial = Trial(each.truth, tries, whole, run(*ids) if ids else whole)
            if each.kind != "outside_strong" or evident(trial, protocol, ruler):
                return trial, each.effects, members
            last = f"{each.truth.law} moves too little"
        except (EvaluationFailed, ValueError) as failure:
            last = failure
        each = drawn_anew(each, protocol, case, group, tries, ruler)
    raise InputError(f"no tyre of kind {each.kind} was found: {last}")


def read_trial(content: dict[str, Any], labels: list[Label]) -> Trial:
    """The trial that `plain_trial` wrote."""
    tables: dict[str, dict[float, Computed]] = {"with_effect": {}, "without": {}}
    for key, table in tables.items():
        for entry in content.pop(key):
            ln_f = {label: tuple(entry["ln_f"][str(label)]) for label in labels}
            table[entry["pressure_kPa"]] = Computed(ln_f, entry["ln_mass"])
    tries = content.pop("tries")
    return Trial(Truth(**content), tries, **tables)


def shifts(trial: Trial, members: Members) -> dict[str, Any]:
    """Shifts by each of several effects while the others are present: tables as ``without``."""
    return {
        id: plain_trial(replace(trial, without=table))["without"] for id, table in members.items()
    }
