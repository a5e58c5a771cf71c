"""Result files of a job: JOB.json (numbers) and JOB.npz (shapes). Same deck, same bytes.

JOB.json: ``steps`` [{step, pressure_Pa, mass_kg, factorisations, modes [{n, frequency_Hz,
eigenvalue, multiplicity; where doublets have split, which doublet of its harmonic from 0 on,
and which member of it, 1 or 2; damping_ratio where a material has a loss factor}],
sensitivities {variable: [d f / d variable, Hz per unit]},
mass_sensitivities {variable: kg per unit}}].
JOB.npz: ``nodes`` (k,), ``points`` (k, 2) R, Z in m, and per step S ``displacement_S`` (k, 3) and
``shapes_S`` (modes, k, 3): complex amplitudes of u = Re[U exp(i n Theta)] in r, theta, z, scaled
to a modal mass of 1 kg of the whole tyre. Displacements are in m. Of a response (`ResponseResult`)
its frequencies, Hz, receptances, m/N or rad/N, and forces on the hub per unit force; in JOB.json
the radius of the tread and the number of harmonics that were summed and that were wanted.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from . import VERSION
from .modes.harmonics import HarmonicModes
from .modes.response import ResponseResult
from .section.model import Model

Array = np.ndarray


@dataclass
class StepResult:
    """Results of one step."""

    step: int  # its number in the deck
    pressure_Pa: float
    mass_kg: float  # of the whole tyre
    modes: list[HarmonicModes]  # by harmonic
    # by variable and harmonic: d lambda / d variable (m,) of its modes, lambda = (2 pi f)^2
    rates: dict[str, list[Array]]
    U: Array  # (k, 3) displacements r, theta, z of the inflated state, m
    factorisations: int  # number of them until the equilibrium
    # by variable: d mass / d variable, kg
    mass_rates: dict[str, float] = field(default_factory=dict)
    damping: list[Array] | None = None  # damping ratios per harmonic; None: no loss factor is known
    response: ResponseResult | None = None


def write(stem: Path, model: Model, results: list[StepResult]) -> None:
    """Write STEM.json and STEM.npz."""
    mesh = model.mesh
    arrays: dict[str, Array] = {"nodes": np.array(list(mesh.index)), "points": mesh.X}
    steps = []
    for result in results:
        order = [
            (float(v), i, j)
            for i, m in enumerate(result.modes)
            for j, v in enumerate(m.eigenvalues)
        ]
        order.sort()
        lines = []
        for value, i, j in order:
            n, members = result.modes[i].n, result.modes[i].members
            line = {
                "n": n,
                "frequency_Hz": _hertz(value),
                "eigenvalue": value,
                "multiplicity": 1 if members is not None else 2 if n else 1,
            }
            if result.damping is not None:
                line["damping_ratio"] = float(result.damping[i][j])
            if members is not None:
                line |= {"doublet": j // 2, "member": int(members[j])}
            lines.append(line)
        rates = {  # lambda = (2 pi f)^2: d lambda = 8 pi^2 f df
            variable: [float(per[i][j] / (8 * np.pi**2 * _hertz(value))) for value, i, j in order]
            for variable, per in result.rates.items()
        }
        steps.append(
            {
                "step": result.step,
                "pressure_Pa": result.pressure_Pa,
                "mass_kg": result.mass_kg,
                "factorisations": result.factorisations,
                "modes": lines,
                "sensitivities": rates,
                "mass_sensitivities": result.mass_rates,
            }
        )
        arrays[f"displacement_{result.step}"] = result.U
        if result.response is not None:
            known = ("radius_m", "harmonics", "harmonics_wanted")
            steps[-1]["response"] = {name: getattr(result.response, name) for name in known}
            for name in ("frequency_Hz", "receptance", "hub"):
                arrays[f"response_{name}_{result.step}"] = getattr(result.response, name)
            for name, matrix in result.response.matrices.items():
                arrays[f"response_{name}_{result.step}"] = matrix
        if order:
            whole = [  # from unit mass per radian to the whole circle's 2 pi, or pi for a wave
                result.modes[i].shapes[j] / np.sqrt(np.pi * (1 if result.modes[i].n else 2))
                for _, i, j in order
            ]
            arrays[f"shapes_{result.step}"] = np.array(whole, np.complex64)
    with stem.with_name(stem.name + ".npz").open("wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]
    text = json.dumps({"format": 1, "solver": f"bundled {VERSION}", "steps": steps}, indent=1)
    stem.with_name(stem.name + ".json").write_text(text + "\n", encoding="utf-8", newline="")


def _hertz(eigenvalue: float) -> float:
    """Frequency; negative for a negative eigenvalue (an unstable mode under a shift)."""
    return float(np.sign(eigenvalue) * np.sqrt(abs(eigenvalue)) / (2 * np.pi))
