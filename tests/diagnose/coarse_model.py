"""The model of the coarse case behind the protocol, and files of its own measurements."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.tyre_model import TyreModel
from tyrecal.studies.inference.uncertainties import sources

from ..chance import generator
from ..effects.support import coarse
from .toy import LABELS

CASE = coarse()
EFFECTS = ("bead_filler", "pressure_offset", "tread_density")
ROWS = [*((label, p) for p in (180.0, 240.0) for label in LABELS), (None, 0.0)]


def model(rows: list = ROWS) -> TyreModel:
    evaluator = Evaluator(TyreDesign(CASE))
    ranges, _ = effect_ranges(CASE, evaluator, EFFECTS)
    return TyreModel(CASE, evaluator, rows, sources(CASE)[0], ranges)


MODEL = model()
X = MODEL.start + np.array((0.2, -0.1, 0.15))


def asked(point: Query) -> Answer:
    (result,) = MODEL.answers([point])
    assert isinstance(result, Answer), result
    return result


def written(path: Path, eta: np.ndarray, rows: list = ROWS, noise: float = 1e-3) -> Path:
    """A file of measurements of the model's own, with scatter."""
    random = generator(3)
    lines = ["quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma"]
    for (label, p), y in zip(rows, eta, strict=True):
        value = float(np.exp(y + noise * random.normal()))
        if label is None:
            lines.append(f"mass_kg,,,,,,,{value!r},{value * noise!r}")
        else:
            place = f"{label.c},{label.m},{label.kind or ''}"
            lines.append(f"frequency_Hz,{place},,{p:g},0,{value!r},{value * noise!r}")
    path.write_text("\n".join(lines) + "\n")
    return path
