"""CalculiX behind the tool's evaluator: write, run, read. Imports nothing of the tool."""

from __future__ import annotations

import json
import re
import shutil
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .. import own_decks
from ..decks import WrittenDecks, save_texts
from ..errors import Refused, RunFailed
from ..process import end_commands, program_version
from ..rings import about_axle
from .results import Fields, pairs, read_eigenvalues, read_fields, read_mass
from .runner import clear, run_job
from .slack import read_strips, refuse_slack

Array = np.ndarray
SECTOR, SETTINGS, INFLATE = "sector.inp", "calculix.json", "inflate"
# deviation from a body of revolution, over the largest displacement, up to which a state is right:
# 2e-4 moves no frequency by 0.001 %, 9e-3 one by 5 %
REVOLVED = 1e-3
OPTIONS: dict[str, Any] = {"parallel": 1, "element": "C3D20R", "ply_thickness_m": 2e-4}


class CalculiX:
    """Adapter of CalculiX (see the tool's solver contract).

    ``command``: words that start ccx. Options: ``parallel``, decks of one evaluation at a time;
    ``element``, C3D20R or C3D8, and ``ply_thickness_m`` are the deck's. A difference in ln of a
    variable needs ``difference_step``, since frequencies have seven digits.
    """

    name = "calculix"
    dialect = "calculix"
    capabilities = frozenset({"modes", "own_decks"})
    refusals = (Refused,)
    failures = (RunFailed,)
    difference_step = 1e-3

    def __init__(self) -> None:
        self.command = ["ccx"]

    @property
    def version(self) -> str:
        """Version as ``ccx -v`` prints it; "unknown" where there is no ccx."""
        return _version(tuple(self.command))

    def write(self, decks: WrittenDecks, folder: Path) -> list[Path]:
        """Write the decks and, next to them, how to run them. Raises Refused."""
        settings = _settings(decks.options)
        paths = own_decks.save(decks.request, folder)
        texts = {**decks.texts(self.dialect), SETTINGS: json.dumps(settings)}
        return paths + save_texts(texts, folder)

    def run(self, folder: Path, time_limit_s: float) -> None:
        """Run every deck; ``time_limit_s`` is for all of them together. Raises RunFailed."""
        settings = json.loads((folder / SETTINGS).read_text(encoding="utf-8"))
        end = time.monotonic() + time_limit_s
        own = own_decks.load(folder)

        def run_one(job: str, *inputs: str) -> None:
            run_job(folder, job, inputs, self.command, max(0.0, end - time.monotonic()))

        def run_modes(job: str) -> None:
            start, ended = f"{job}.rin", f"{job}.rout"
            shutil.copy(state, folder / start)
            run_one(job, start)
            for name in (start, ended):
                (folder / name).unlink(missing_ok=True)

        if own:
            texts = [path.relative_to(folder).as_posix() for path in folder.rglob("*.inp")]
            for job, before in own.jobs:
                if before:
                    shutil.copy(folder / f"{before}.rout", folder / f"{job}.rin")
                run_one(job, *texts, *([f"{job}.rin"] if before else []))
            return
        _check_rubber(folder / SECTOR)
        jobs, state = [job for _, job in _jobs(folder)], folder / f"{INFLATE}.rout"
        for job in (INFLATE, *jobs):
            clear(folder, job)
        run_one(INFLATE, SECTOR)
        if not state.exists() or not state.stat().st_size:
            raise RunFailed("no_results", f"CalculiX left no {state.name}")
        if strips := read_strips(folder / SECTOR):
            refuse_slack(strips, _inflated(folder / f"{INFLATE}.frd")[0])
        if settings["parallel"] == 1:  # in this thread, so that Ctrl-C ends ccx at once
            for job in jobs:
                run_modes(job)
        else:
            pool = ThreadPoolExecutor(settings["parallel"])
            try:
                list(pool.map(run_modes, jobs))
            except KeyboardInterrupt:
                end_commands()
                raise
            finally:
                pool.shutdown(cancel_futures=True)  # what has not begun, after a failure
        state.unlink()

    def read(self, folder: Path) -> dict[str, Any]:
        """Results as plain data, shapes on the section at Theta = 0. Raises RunFailed."""
        if own := own_decks.load(folder):
            return _of_own_decks(folder, own)
        modes, jobs = [], _jobs(folder)
        if not jobs:
            raise RunFailed("no_results", "there are no decks in the folder")
        sectors = int(_find(r"\*CYCLIC SYMMETRY MODEL, *N=(\d+)", folder / SECTOR))
        pressure = _find(r"\*DLOAD\s+CAVITY, *\w+, *(\S+)", folder / f"{INFLATE}.inp")
        inflated, front = _inflated(folder / f"{INFLATE}.frd")
        for diameter, job in jobs:
            deck = folder / f"{job}.inp"
            count = int(_find(r"\*FREQUENCY\s+(\d+)", deck))
            eigenvalues = read_eigenvalues(folder / f"{job}.dat", diameter, count)
            fields = read_fields(folder / f"{job}.frd")
            values = pairs(eigenvalues, f"{job}.dat")
            shapes = _shapes(fields, len(values), diameter, sectors, job)
            modes += [
                {
                    "frequency_Hz": float(np.sqrt(value) / (2 * np.pi)),
                    "multiplicity": 2 if diameter else 1,
                    "n": diameter,
                    "amplitude": shape,
                }
                for value, shape in zip(values, shapes, strict=True)
            ]
        return {
            "pressure_Pa": float(pressure),
            "mass_kg": sectors * read_mass(folder / f"{INFLATE}.dat"),
            "modes": modes,
            "gradients": {},
            "nodes": inflated.nodes[front],
            "points": inflated.points[front][:, [0, 2]],
            "displacement": inflated.blocks[0][2][front],
        }


def _of_own_decks(folder: Path, own: own_decks.DecksOfRun) -> dict[str, Any]:
    """Results of a user's decks, shapes at the crown's nodes. Raises RunFailed."""
    table = folder / f"{own.last}.dat"
    eigenvalues = read_eigenvalues(table, None, own.modes)
    fields = read_fields(folder / f"{own.last}.frd", static=False)
    displacements = {mode: values for mode, name, values in fields.blocks if name == "DISP"}
    if set(displacements) != set(range(1, len(eigenvalues) + 1)):
        raise RunFailed("no_results", f"{own.last}.frd lacks shapes of modes")
    points, turn = about_axle(fields.points)
    shapes = np.array([displacements[mode] for mode in sorted(displacements)]) @ turn.T
    mass = sum(read_mass(table, name) for name in own.mass_sets)
    return own_decks.results(own, mass, eigenvalues, points, shapes)


def _inflated(path: Path) -> tuple[Fields, Array]:
    """The inflated state, and which of its nodes (k,) are at Theta = 0, whose x, y, z are r, theta,
    z. Raises RunFailed (``unstable``) where other nodes do not move as those do: reduced
    integration lets an element's middle buckle between its faces, which had moved frequencies by up
    to 5 %."""
    from scipy.spatial import KDTree

    fields = read_fields(path)
    x, y, z = fields.points.T
    front = np.flatnonzero(y == 0)
    if not len(front):
        raise RunFailed("no_results", f"{path.name} has no nodes at Theta = 0")
    _, nearest = KDTree(fields.points[front][:, [0, 2]]).query(np.stack([np.hypot(x, y), z], -1))
    turn = np.arctan2(y, x)
    u, v, w = fields.blocks[0][2].T
    moved = np.stack(
        [np.cos(turn) * u + np.sin(turn) * v, np.cos(turn) * v - np.sin(turn) * u, w], -1
    )
    off = abs(moved - moved[front][nearest]).max(1)
    if off.max() > REVOLVED * abs(moved).max():
        raise RunFailed(
            "unstable",
            f"CalculiX's inflated tyre is no body of revolution: node {fields.nodes[off.argmax()]}"
            f" is {1e6 * off.max():.3g} micrometres off; element C3D20 may work",
        )
    return fields, front


@lru_cache
def _version(command: tuple[str, ...]) -> str:
    return program_version([*command, "-v"], r"Version (\S+)", 20.0)


def _shapes(fields: Fields, count: int, n: int, sectors: int, job: str) -> list[Array]:
    """Amplitudes (nodes, 3), complex, of the first mode of ``count`` pairs with ``n`` waves round
    the tyre, mass-normalised to the tyre.

    At Theta = 0, x, y, z are r, theta, z. CalculiX normalises to one sector's mass, and lists each
    mode of every diameter twice. Raises RunFailed (``no_results``).
    """
    parts = {(mode, name): values for mode, name, values in fields.blocks}
    shapes = []
    for mode in range(1, 2 * count, 2):
        if not {(mode, "DISP"), (mode, "DISPI")} <= parts.keys():
            raise RunFailed("no_results", f"{job}.frd lacks shapes of modes")
        shape = parts[mode, "DISP"] + 1j * parts[mode, "DISPI"]
        largest = shape.ravel()[abs(shape).argmax()]
        if not abs(largest) > 0:
            raise RunFailed("no_results", f"{job}.frd: the shape of mode {mode} is no shape")
        turned = shape * abs(largest) / largest  # a pair's phase is arbitrary: make it definite
        # the modal mass of Re[turned exp(i n Theta)] all round is ``sectors``, or half of that for
        # waves
        shapes.append(turned * np.sqrt((2 if n else 1) / sectors))
    return shapes


def _jobs(folder: Path) -> list[tuple[int, str]]:
    """Nodal diameter and job name of each deck."""
    decks = folder.glob("modes_*.inp")
    return sorted((int(path.stem.removeprefix("modes_")), path.stem) for path in decks)


def _check_rubber(path: Path) -> None:
    """ccx gives frequencies of rubber that is none: it looks for eigenvalues next to zero, and
    does not see the negative ones. Raises RunFailed (``unstable``)."""
    for row in re.findall(r"\*HYPERELASTIC[^\n]*\n([^\n*]*)", path.read_text(encoding="utf-8")):
        try:
            *shear, D1 = (float(value) for value in row.split(","))
        except ValueError:
            continue  # ccx complains of it
        if sum(shear) <= 0 or D1 <= 0:
            raise RunFailed(
                "unstable",
                f"{path.name}: rubber of C10 + C01 = {sum(shear):g}, D1 = {D1:g} is unstable",
            )


def _find(pattern: str, path: Path) -> str:
    match = re.search(pattern, path.read_text(encoding="utf-8"), re.I)
    if not match:
        raise RunFailed("no_results", f"{path.name} has no {pattern.split(' *')[0]}")
    return match[1]


def _settings(given: Mapping[str, Any]) -> dict[str, Any]:
    unknown = [name for name in given if name not in OPTIONS]
    if unknown:
        raise Refused(f"solver.options: calculix has no '{unknown[0]}', only {', '.join(OPTIONS)}")
    settings = {**OPTIONS, **given}
    if type(settings["parallel"]) is not int or settings["parallel"] < 1:
        raise Refused(f"solver.options.parallel is '{settings['parallel']}', must be 1 or more")
    return {"parallel": settings["parallel"]}
