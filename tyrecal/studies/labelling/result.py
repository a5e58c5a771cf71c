"""Result of a labelling in the form of `studies.labels`, for its files."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from ...files import Json
from ...measured.shapes import shapes_of
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
from ...tyre.state import TyreState
from ..correlation import correlate
from ..labels import (
    FOREIGN_WORDS,
    MAX_RIVALS,
    MIN_RIVAL_PROBABILITY,
    Labeling,
    LabelledFrequency,
    LabelProbability,
    Labels,
    LabelsResult,
)
from .label import Labelled

if TYPE_CHECKING:
    from ...measured.case_modes import CaseModes
    from ...measured.modal import ModalTest


def labels_posterior(case: LoadedCase, labelled: Labelled) -> Labels:
    """Labels of the readings that came without one."""
    all_labelings, at = labelled.found.labelings, labelled.found.expansion
    own = [i for i, each in enumerate(labelled.frequencies) if each[0].label is None]
    places = {
        key: n
        for n, key in enumerate(zip(labelled.start.labels, labelled.start.states, strict=True))
    }
    frequencies = []
    for i in own:
        reading = labelled.frequencies[i][0]
        state = reading.state.of(case).with_defaults(case)
        j = int(all_labelings.modes[0, i])
        expected = places.get((at.labels[j], at.states[j])) if j >= 0 else None
        others = [
            n
            for n in np.argsort(-all_labelings.each[i], kind="stable")
            if n != j % all_labelings.each.shape[1]
        ]
        likely = [
            n for n in others[:MAX_RIVALS] if all_labelings.each[i, n] >= MIN_RIVAL_PROBABILITY
        ]
        name = lambda n: at.labels[n] if 0 <= n < len(at.labels) else None
        frequencies.append(
            LabelledFrequency(
                **_entry(name(j)),
                probability=float(all_labelings.each[i, j]),
                frequency_Hz=reading.value,
                sigma_Hz=reading.sigma,
                pressure_kPa=state.pressure_kPa or 0.0,
                rim=state.rim or "",
                expected_Hz=None
                if expected is None
                else float(np.exp(labelled.start.ln_f[expected])),
                rivals=[
                    LabelProbability(**_entry(name(n)), probability=float(all_labelings.each[i, n]))
                    for n in likely
                ],
            )
        )
    kept = [
        k for k, p in enumerate(all_labelings.probabilities) if p >= MIN_RIVAL_PROBABILITY or not k
    ]
    labelings = [
        Labeling(
            labels=[
                each.display if (each := labelled.found.labels(k)[i]) else FOREIGN_WORDS
                for i in own
            ],
            probability=float(all_labelings.probabilities[k]),
        )
        for k in kept[: 1 + MAX_RIVALS]
    ]
    return Labels(
        frequencies=frequencies,
        labelings=labelings,
        model_off_percent=100 * all_labelings.discrepancy,
        expansions=labelled.found.rounds,
        settled=labelled.found.settled,
    )


def labels_result(case: LoadedCase, labelled: Labelled) -> LabelsResult:
    """Labels as a result of their own."""
    return LabelsResult.model_validate({"format": 1, "labels": labels_posterior(case, labelled)})


def shape_labels_result(run: ModalTest, case_modes: CaseModes, state: TyreState) -> LabelsResult:
    """The labels that shapes of a universal file, measured in a state, got by a case's modes."""
    frequencies = []
    for each in run.modes:
        label, likely = each.judged.label, each.judged.probabilities
        rivals = [
            (own, p) for own, p in likely.items() if own != label and p >= MIN_RIVAL_PROBABILITY
        ]
        sigma = each.mode.sigma_Hz
        frequencies.append(
            LabelledFrequency(
                **_entry(label),
                probability=likely[label] if label else 1 - sum(p for _, p in rivals),
                frequency_Hz=each.mode.frequency_Hz,
                sigma_Hz=sigma if sigma > 0 else None,
                pressure_kPa=state.pressure_kPa or 0.0,
                rim=state.rim or "",
                expected_Hz=case_modes.expected_Hz(label),
                rivals=[
                    LabelProbability(**_entry(own), probability=p) for own, p in rivals[:MAX_RIVALS]
                ],
            )
        )
    pairs = [(f.frequency_Hz, f.expected_Hz) for f in frequencies if f.expected_Hz]
    off = np.log([measured / expected for measured, expected in pairs])
    together = Labeling(
        labels=[each.display for each in frequencies],
        probability=float(np.prod([each.probability for each in frequencies if each.label])),
    )
    labels = Labels(
        frequencies=frequencies,
        labelings=[together],
        model_off_percent=100 * float(np.sqrt(np.mean(off**2))) if len(off) else 0.0,
        expansions=1,
        settled=True,
    )
    tests = shapes_of(run, state.pressure_kPa or 0.0)
    shapes = [correlate(each, case_modes) for each in tests]
    return LabelsResult(format=1, labels=labels, shapes=shapes)


def _entry(label: Label | None) -> Json:
    """c, m and kind, None of what is no mode."""
    return asdict(label) if label else dict.fromkeys(("c", "m", "kind"))
