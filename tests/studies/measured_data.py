"""Writes cases/measured: a modal test of the P235/75R17 that never took place.

    python tests/studies/measured_data.py [folder]

The tyre is the model of cases/p235_75r17.yaml at the design TRUTH, with modal damping that the
model lacks. At 240 kPa: accelerances from a skewed shaker at the shoulder, measured three times,
the tyre mounted again between; at 200 kPa: complex mode shapes, as a laboratory's own software
identified them; at 280 kPa: a table from a spreadsheet with semicolons and decimal commas. One more
file is of that tyre in a clamp that tilts (the effect spindle_tilt). Noise, errors of gain,
direction and place of the sensors, and the scatter of mounting are drawn from one seed.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyuff

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import HarmonicShape
from tyrecal.simulate.modes.label import Label, Mode, paired_labels
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

Array = np.ndarray

CASES = Path(__file__).parents[2] / "cases"
TRUTH = {"A_belt": 2.6e-7, "A_carcass": 3.6e-7, "C10": 1.08e6}
SEED = 20
FREQUENCIES = np.arange(25.0, 135.01, 0.625)  # Hz
BAND = (28.0, 132.0)  # Hz: the modes in it
ANGLES = np.radians([7, 41, 88, 123, 169, 205, 251, 290])  # of the sensors on the tread
ACROSS = (0.0, 0.06, -0.06, 0.0, 0.06, -0.06, 0.0, 0.06)  # m, their places over the width
SIDEWALL = ((0.31, 15.0), (0.33, 140.0), (0.32, -100.0))  # R in m and angle in degrees, + side
NO_TANGENTIAL = (3, 6, 8)  # sensors on the tread that have two directions only
DRIVEN = ((0.07, np.radians(20.0)), np.array([0.55, 0.70, 0.45]))  # place; direction r, theta, z
HIGHEST, PER_HARMONIC, CEILING = 8, 8, 500.0  # modes that the accelerances are summed from, Hz
NOISE = 0.01  # of the accelerances' root mean square
GAIN, TURN, PLACE = 0.03, 0.03, 0.003  # of sensors: relative, rad, m
MOUNTING, REPEAT = 0.001, 0.0005  # relative scatter of all frequencies together, of each
SPLIT = 0.004  # relative, of doublets at 200 kPa
SOFT_CLAMP = {"effects.spindle_tilt": 2.4e-6}  # rad/(N m)
SOFT_CLAMP_SIGMA = 0.002  # relative


@dataclass(frozen=True)
class Sensor:
    """number; node of the model that it sits at; its true and its noted place and directions."""

    number: int
    node: int
    point: Array  # R, Theta, Z
    noted: Array
    directions: Array  # (3, 3): rows are what it calls r, theta, z
    measures: tuple[int, ...]


def evaluated(pressure_kPa: float, effects: Mapping[str, float] | None = None) -> list[Mode]:
    """Return all modes of the true tyre, with effects by path."""
    case = load_case(CASES / "p235_75r17.yaml")
    case = with_values(case, {"analysis.highest_harmonic": HIGHEST, **(effects or {})})
    question = Question({**TRUTH, "pressure_kPa": pressure_kPa}, (), PER_HARMONIC)
    modes = paired_labels(Evaluator(TyreDesign(case)).evaluate(question).modes)
    return sorted((m for m in modes if m.frequency_Hz < CEILING), key=lambda m: m.frequency_Hz)


def nearest(shape: HarmonicShape, z: float | None, r: float | None = None) -> int:
    """The row of the outer surface's node at z on the tread, or at r on the + sidewall."""
    R, Z = shape.points.T
    if z is not None:
        return int(np.argmax(R - 5 * abs(Z - z)))
    return int(np.argmax(Z - 5 * abs(R - r)))


def sensors(shape: HarmonicShape, rng: np.random.Generator) -> list[Sensor]:
    places = [(nearest(shape, z), angle) for z, angle in zip(ACROSS, ANGLES, strict=True)]
    places += [(nearest(shape, None, r), np.radians(angle)) for r, angle in SIDEWALL]
    result = []
    for number, (node, angle) in enumerate(places, start=1):
        point = np.array([shape.points[node, 0], angle, shape.points[node, 1]])
        noted = point + PLACE * rng.standard_normal(3) / [1.0, point[0], 1.0]
        turned = np.eye(3) + TURN * rng.standard_normal((3, 3))
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        measures = (0, 1, 2) if number <= len(ANGLES) else (2,)
        measures = tuple(k for k in measures if k != 1 or number not in NO_TANGENTIAL)
        result.append(Sensor(number, node, point, noted, turned, measures))
    return result


def members(mode: Mode, node: int, angle: float) -> Array:
    """Motion r, theta, z of the two halves of a pair (or of a single mode) at a place."""
    shape = mode.raw.shape
    assert isinstance(shape, HarmonicShape)
    phases = (np.pi / 2, np.pi) if shape.n else (0.0,)
    turn = np.exp(1j * (shape.n * angle + np.array(phases)))
    return (shape.amplitude[node] * turn[:, None]).real


def damping(modes: list[Mode], rng: np.random.Generator) -> Array:
    """Damping ratios: about 2.5 %, no two modes' alike."""
    return rng.uniform(0.02, 0.032, len(modes))


def accelerances(
    modes: list[Mode], ratios: Array, places: list[Sensor], rng: np.random.Generator
) -> dict[tuple[int, int], Array]:
    """Functions by sensor and direction: sum of phi_i phi_j (-w^2) / (w_k^2 - w^2 + 2 i zeta w
    w_k)."""
    (z, angle), direction = DRIVEN
    first = modes[0].raw.shape
    assert isinstance(first, HarmonicShape)
    driven = nearest(first, z)
    w = 2 * np.pi * FREQUENCIES
    signals = [(s, k) for s in places for k in s.measures]
    H = np.zeros((len(signals), len(w)), complex)
    common = 1 + MOUNTING * rng.standard_normal()
    for mode, ratio in zip(modes, ratios, strict=True):
        wk = 2 * np.pi * mode.frequency_Hz * common * (1 + REPEAT * rng.standard_normal())
        force = members(mode, driven, angle) @ direction
        phi = np.array(
            [s.directions[k] @ members(mode, s.node, s.point[1]).T @ force for s, k in signals]
        )
        H += np.outer(phi, -(w**2) / (wk**2 - w**2 + 2j * ratio * w * wk))
    H *= 1 + GAIN * rng.standard_normal((len(signals), 1))
    size = NOISE * np.sqrt(np.mean(np.abs(H) ** 2) / 2)
    H += size * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
    return {(s.number, k + 1): row for (s, k), row in zip(signals, H, strict=True)}


def geometry(places: list[Sensor]) -> list[dict]:
    """Units (164), nodes (2411) and a trace line (82); millimetres, the axle along y."""
    R, angle, Z = np.array([s.noted for s in places]).T
    numbers = np.array([s.number for s in places])
    whole = np.ones(len(places), int)
    return [
        pyuff.prepare_164(
            units_code=5,
            units_description="mm (milli newton)",
            temp_mode=1,
            length=1e3,
            force=1e3,
            temp=1.0,
            temp_offset=273.15,
        ),
        {
            "type": 2411,
            "node_nums": numbers,
            "def_cs": whole,
            "disp_cs": whole,
            "color": whole,
            "x": 1e3 * R * np.sin(angle),
            "y": 1e3 * Z,
            "z": 1e3 * R * np.cos(angle),
        },
        pyuff.prepare_82(
            trace_num=1, n_nodes=9, color=1, id="tread", nodes=np.array([1, 2, 3, 4, 5, 6, 7, 8, 1])
        ),
    ]


def function(response: tuple[int, int], values: Array, title: str) -> dict:
    """A data set 58: an accelerance in single precision."""
    return {
        "type": 58,
        "binary": 0,
        "func_type": 4,
        "rsp_node": response[0],
        "rsp_dir": response[1],
        "ref_node": 99,
        "ref_dir": 1,
        "data": values,
        "x": FREQUENCIES,
        "ord_data_type": 5,
        "id1": title,
        "id2": "synthetic: no such test took place",
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": 18,
        "ordinate_spec_data_type": 12,
        "orddenom_spec_data_type": 13,
    }


def write_functions(folder: Path, rng: np.random.Generator) -> None:
    modes = evaluated(240.0)
    places = sensors(modes[0].raw.shape, rng)  # type: ignore[arg-type]
    ratios = damping(modes, rng)
    for repeat in (1, 2, 3):
        path = folder / f"p235_75r17_240kPa_{repeat}.uff"
        path.unlink(missing_ok=True)
        H = accelerances(modes, ratios, places, rng)
        title = f"P235/75R17, 240 kPa, repeat {repeat}"
        sets = [*geometry(places), *(function(signal, H[signal], title) for signal in H)]
        pyuff.UFF(str(path)).write_sets(sets, mode="overwrite", force_double=False)


def write_shapes(folder: Path, rng: np.random.Generator) -> None:
    """Write both members of each doublet, turned by some angle round the tyre, each with a
    phase."""
    modes = evaluated(200.0)
    places = sensors(modes[0].raw.shape, rng)  # type: ignore[arg-type]
    sets = geometry(places)
    number = 0
    for mode, ratio in zip(modes, damping(modes, rng), strict=True):
        if not BAND[0] < mode.frequency_Hz < BAND[1]:
            continue
        phase = rng.uniform(0, 2 * np.pi)
        turns = ((np.cos(phase), np.sin(phase)), (-np.sin(phase), np.cos(phase)))
        for half, turn in enumerate(turns if mode.label.c else ((1.0,),)):
            number += 1
            u = np.zeros((len(places), 3), complex)
            for row, s in enumerate(places):
                motion = np.array(turn) @ members(mode, s.node, s.point[1])
                for k in s.measures:
                    u[row, k] = s.directions[k] @ motion * (1 + GAIN * rng.standard_normal())
            size = NOISE * np.abs(u).max()
            noise = rng.standard_normal(u.shape) + 1j * rng.standard_normal(u.shape)
            u = np.where(u == 0, 0, u + size * noise) * np.exp(2j * np.pi * rng.uniform())
            hertz = mode.frequency_Hz * (1 + SPLIT * (half - 0.5 * (mode.label.c > 0)))
            hertz *= 1 + REPEAT * rng.standard_normal()
            w = 2 * np.pi * hertz
            sets.append(
                {
                    "type": 55,
                    "model_type": 1,
                    "analysis_type": 3,
                    "data_ch": 2,
                    "load_case": 1,
                    "spec_data_type": 12,
                    "mode_n": number,
                    "data_type": 5,
                    "n_data_per_node": 3,
                    "eig": -ratio * w + 1j * w * np.sqrt(1 - ratio**2),
                    "node_nums": np.array([s.number for s in places]),
                    "r1": u[:, 0],
                    "r2": u[:, 1],
                    "r3": u[:, 2],
                    "id1": "P235/75R17, 200 kPa",
                    "id2": "synthetic: no such test took place",
                }
            )
    path = folder / "p235_75r17_200kPa_shapes.uff"
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")


def write_table(folder: Path, rng: np.random.Generator) -> None:
    lines = ["Messung;Eigenform;Fülldruck [bar];Eigenfrequenz [Hz];Dämpfung [%]"]
    modes = [m for m in evaluated(280.0) if BAND[0] < m.frequency_Hz < BAND[1]]
    names = {Label(0, 0, "axial"): "[0,0] axial", Label(0, 0, "torsional"): "[0,0] torsional"}
    for run in (1, 2, 3):
        common = 1 + MOUNTING * rng.standard_normal()
        for mode in modes:
            hertz = mode.frequency_Hz * common * (1 + REPEAT * rng.standard_normal())
            cells = (run, names.get(mode.label, str(mode.label)), "2,8", f"{hertz:.2f}", "2,5")
            lines.append(";".join(str(cell).replace(".", ",") for cell in cells))
    text = "\r\n".join(lines) + "\r\n"
    (folder / "p235_75r17_280kPa_table.csv").write_bytes(text.encode("utf-8-sig"))


def write_soft_clamp(folder: Path, rng: np.random.Generator) -> None:
    """A measurements CSV of the tyre in a clamp that tilts."""
    lines = ["label,frequency_Hz,sigma_Hz,pressure_kPa"]
    for mode in evaluated(240.0, SOFT_CLAMP):
        if BAND[0] < mode.frequency_Hz < BAND[1]:
            sigma = SOFT_CLAMP_SIGMA * mode.frequency_Hz
            hertz = mode.frequency_Hz + sigma * rng.standard_normal()
            label = {"axial": "[0,0] lateral", "torsional": "[0,0] torsional"}
            name = label.get(mode.label.kind, str(mode.label))
            lines.append(f'"{name}",{hertz:.2f},{sigma:.2f},240')
    (folder / "p235_75r17_soft_clamp.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for seed, write in enumerate((write_functions, write_shapes, write_table, write_soft_clamp)):
        write(folder, np.random.default_rng((SEED, seed)))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else CASES / "measured")
