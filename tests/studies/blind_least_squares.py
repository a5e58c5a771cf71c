"""The blind studies once more: how far an ordinary calibration's error shrinks with the effect.

    python -m tests.studies.blind_least_squares

Made after the studies, without anything to choose: least squares of the given modes' ln f in the
ruler's model of the plain tyre, then with the named effect (the likeliest, on tyres without any) at
the size that the answer states; both against the truth at the held-out pressure. Trials with
exchanged labels are left out, an ordinary calibration would be misled by them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.answer import case_of
from tyrecal.studies.blind.protocol import Protocol, open_truth, read_protocol
from tyrecal.studies.blind.ruler import EffectShifts, Ruler, read_ruler
from tyrecal.studies.blind.score import DETECTED, Scored, means, score
from tyrecal.studies.fit.targets import labels_to_measure

from ..blind.archive import STUDIES, unpack

Array = np.ndarray
STEPS, LONGEST = 20, 0.5


def errors(folder: Path, trials: Sequence[Scored]) -> dict[str, Array]:
    """Rms errors held out, in ln f, (trials, 2), of calibrations without and with the effect, by
    kind of trial: "effect" (detectable and named) and "none". ``trials``: as they were scored."""
    protocol, labels = read_protocol(folder), labels_to_measure(case_of(folder))
    ruler = read_ruler(folder)
    scored = {each.id: each for each in trials}
    by_kind: dict[str, list[list[float]]] = {"effect": [], "none": []}
    for truth in open_truth(folder, folder.with_name("trials-truth"))["trials"]:
        own = scored[truth["id"]]
        proven = own.verdict == "named" and own.band >= DETECTED
        if own.swapped or own.kind not in by_kind or (own.kind == "effect" and not proven):
            continue
        diagnosis = json.loads((folder / "answers" / f"{own.id}.json").read_text())["diagnosis"]
        key = (diagnosis["effect"] or diagnosis["likeliest"]).split("+")[0]
        y, places, _ = means(read_measurements(folder / "trials" / f"{own.id}.csv"), ruler)
        out = held_out(truth, ruler, protocol, labels)
        error = partial(held_out_rms, ruler, y, places, out)
        by_kind[own.kind].append([error({}), error({key: diagnosis["parameter"]["value"]})])
    return {kind: np.array(rows) for kind, rows in by_kind.items()}


def held_out(
    truth: Mapping[str, Any], ruler: Ruler, protocol: Protocol, labels: Sequence[Label]
) -> dict[int, float]:
    """ln f by row of the ruler of what was measured at the held-out pressure."""
    return {
        ruler.rows.index((label, protocol.held_out_kPa)): float(np.log(hertz).mean())
        for label in labels
        if (hertz := truth["held_out"].get(str(label)))
    }


def held_out_rms(
    ruler: Ruler, y: Array, places: Array, out: Mapping[int, float], effects: Mapping[str, float]
) -> float:
    """Error (rms, in ln f) of what least squares of the modes among y (n,), with effects at their
    sizes, say of the rows ``out``."""
    modal = np.array([ruler.rows[i][0] is not None for i in places])
    y, places, held = y[modal], places[modal], np.array(list(out))
    d, spread = np.zeros(len(ruler.x0)), np.diag(ruler.spread**-2.0) * 0.002**2
    moved, tilt = _moved(ruler, np.concatenate([places, held]), effects)
    n = len(places)
    for _ in range(STEPS):
        eta, J = ruler.plain(d, places)
        off = y - eta - moved[:n] - tilt[:n] @ d
        step = np.linalg.solve(J.T @ J + spread, J.T @ off - spread @ d)
        d = d + step * min(1.0, LONGEST / max(abs(step).max(), 1e-300))
    foretold = ruler.plain(d, held)[0] + moved[n:] + tilt[n:] @ d
    return float(np.sqrt(np.mean((np.array(list(out.values())) - foretold) ** 2)))


def _moved(ruler: Ruler, places: Array, effects: Mapping[str, float]) -> tuple[Array, Array]:
    """Shift (n,) at x0 by effects at their sizes, and its slopes (n, v) by ln x."""
    origin, units = np.zeros(len(ruler.x0)), np.eye(len(ruler.x0))
    moved, tilt = np.zeros(len(places)), np.zeros((len(places), len(units)))
    for id, e in effects.items():
        signature: EffectShifts = ruler.signatures[id]
        at_x0 = _at(e, *signature.grid(origin, places)[:2])
        moved += at_x0
        tilt += np.stack([_at(e, *signature.grid(d, places)[:2]) - at_x0 for d in units], 1)
    return moved, tilt


def _at(e: float, sizes: Array, values: Array) -> Array:
    """Values (q, n) at sizes (q,), between which they are straight, at the size e: (n,)."""
    e = float(np.clip(e, sizes[0], sizes[-1]))
    j = min(int(np.searchsorted(sizes, e, side="right")), len(sizes) - 1)
    share = (e - sizes[j - 1]) / (sizes[j] - sizes[j - 1])
    return np.asarray(values[j - 1] + share * (values[j] - values[j - 1]))


def main() -> None:
    print("| study | trials | error without, % | with, % | shrinks by, median | placebo's 95 % |")
    print("|---|---|---|---|---|---|")
    for study in STUDIES:
        with TemporaryDirectory() as place:
            unpack(study, Path(place) / "trials")
            folder = Path(place) / "trials"
            by_kind = errors(folder, score(folder, folder.with_name("trials-truth")))
        before, after = 100 * np.median(by_kind["effect"], 0)
        shrinks, chance = (
            1 - by_kind[kind][:, 1] / by_kind[kind][:, 0] for kind in ("effect", "none")
        )
        print(
            f"| {study} | {len(shrinks)} | {before:.2f} | {after:.2f} |"
            f" {np.median(shrinks):.2f} | {np.quantile(chance, 0.95):.2f} |"
        )


if __name__ == "__main__":
    main()
