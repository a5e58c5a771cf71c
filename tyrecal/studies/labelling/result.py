"""Result of a labelling in the form of `studies.labels`, for its files."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from ...files import Json
from ...measured.case_modes import CaseModes
from ...simulate.modes.label import Label
from ...tyre.case import LoadedCase
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
from .label import Labelled, labelled_shapes


def labels_posterior(case: LoadedCase, labelled: Labelled) -> Labels:
    """Labels of the readings that came without one."""
    all_labelings, at = labelled.found.labelings, labelled.found.expansion
    # each frequency is a reading, or the two of a doublet
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
        others = [  # -1, no mode, is the last column
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
    """Labels as a result of their own, and the measured shapes next to the model's."""
    at, shapes = labelled.found.expansion, []
    for test in labelled_shapes(case, labelled):
        kPa = [each.with_defaults(case).pressure_kPa for each in labelled.states]
        place = int(np.argmin(abs(np.array(kPa) - test.pressure_kPa)))
        modes = [each for each, i in zip(at.modes, at.states, strict=True) if i == place]
        shapes.append(correlate(test, CaseModes(modes)))
    content: Json = {"format": 1, "labels": labels_posterior(case, labelled)}
    return LabelsResult.model_validate(content | ({"shapes": shapes} if shapes else {}))


def _entry(label: Label | None) -> Json:
    """c, m and kind, None of what is no mode."""
    return asdict(label) if label else dict.fromkeys(("c", "m", "kind"))
