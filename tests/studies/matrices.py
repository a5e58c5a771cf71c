"""Reduced matrices (`tyrecal export --format matrices`) against the full model.

    python -m tests.studies.matrices

Two cases at three pressures, a loss factor of 0.1 in each compound, as shipped. Files are read by
`test_matrices.read_matrix_market`, in NumPy alone. Frequencies are compared with those of the
modes; forces and moments on the hub by forces at five points with those of `tyrecal frf`, 0 to
300 Hz by 0.5 Hz, where they are above a thousandth of the largest.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import time

import numpy as np

from tests.conftest import CASES
from tests.studies.test_matrices import POINTS, read_matrix_market
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.studies.matrices import MATRIX_PATCH_mm, matrix_files
from tyrecal.studies.response import HUB_CHANNELS, response_request
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

TYRES = {"p235_75r17": (160.0, 240.0, 320.0), "205_60r15": (180.0, 220.0, 260.0)}
LOSS, MIN_SHARE, STEP_HZ = 0.1, 1e-3, 0.5


def main() -> None:
    """Print a line for each tyre and pressure."""
    print("tyre | kPa | coordinates | s | modes, relative | hub, dB | of the largest", flush=True)
    request = response_request(POINTS, POINTS, 0.0, 300.0, STEP_HZ, MATRIX_PATCH_mm)
    for tyre, pressures in TYRES.items():
        case = load_case(CASES / f"{tyre}.yaml")
        rubbers = [k for k, m in case.case.materials.items() if hasattr(m, "loss_factor")]
        case = with_values(case, {f"materials.{name}.loss_factor": LOSS for name in rubbers})
        for kPa in pressures:
            began = time.process_time()
            files = matrix_files(case, "", kPa, points=POINTS)
            seconds = time.process_time() - began
            names = ("stiffness", "mass", "loss", "tread")
            K, M, D, R = (read_matrix_market(files[f"{name}.mtx"]) for name in names)
            values = {**start_values(case), "pressure_kPa": kPa}
            answer = Evaluator(TyreDesign(case)).evaluate(Question(values, response=request))
            own = np.sqrt(np.linalg.eigvalsh(K[6:, 6:])) / (2 * np.pi)
            off = [np.abs(own / mode.frequency_Hz - 1).min() for mode in answer.modes]
            worst, share = 0.0, 0.0
            hub = np.array(answer.response["hub"])
            for i, hertz in enumerate(answer.response["frequency_Hz"]):
                Z = K + 1j * D - (2 * np.pi * hertz) ** 2 * M
                forces = R.T[:6] - Z[:6, 6:] @ np.linalg.solve(Z[6:, 6:], R.T[6:] + 0j)
                for k, (place, sign) in enumerate(HUB_CHANNELS.values()):
                    full, largest = sign * hub[place, :, i], np.abs(hub[place]).max()
                    large = np.abs(full) > MIN_SHARE * largest
                    ratios = np.abs(forces[k][large] / full[large])
                    worst = max(worst, np.abs(20 * np.log10(ratios)).max(initial=0.0))
                    share = max(share, float(np.abs(forces[k] - full).max() / largest))
            print(
                f"{tyre} | {kPa:g} | {len(M)} | {seconds:.1f} | {max(off):.0e} | {worst:.3f}"
                f" | {share:.1e}",
                flush=True,
            )


if __name__ == "__main__":
    main()
