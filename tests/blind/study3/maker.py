"""FEniCSx as a maker: one process that answers many tyres."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.errors import InputError
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode
from tyrecal.simulate.modes.find import match
from tyrecal.simulate.modes.label import Label, label_modes
from tyrecal.studies.blind.maker import Computed

from ...studies.judge import PYTHON
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
