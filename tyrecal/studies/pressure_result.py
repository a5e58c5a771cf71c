"""The content of pressure_sweep.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..case import LoadedCase
from ..fit.problem import read_targets
from ..modes.mode import Label
from .modes import mode_entry
from .pressure import Failure, Outcome, State
from .pressure_findings import findings


def sweep_result(
    case: LoadedCase, designs: Mapping[str, Mapping[str, float]], outcomes: Sequence[Outcome]
) -> dict[str, Any]:
    """The content of pressure_sweep.json: ``rows``, ``failed``, ``findings`` of each design with
    two pressures or more, the ``designs``' values, and where the slopes come from.

    outcomes: of ``sweep``, one State at least.
    """
    states = [each for each in outcomes if isinstance(each, State)]
    labels = _swept_labels(case, states)
    by_design = [[s for s in states if s.design == name] for name in designs]
    return {
        "format": 1,
        "slopes": "exact" if all(s.slopes is not None for s in states) else "differences",
        "designs": {name: dict(values) for name, values in designs.items()},
        "rows": [row for each in by_design for row in _rows(each, labels)],
        "failed": [
            {
                "design": each.design,
                "pressure_kPa": each.pressure_kPa,
                "cause": each.failed.cause,
                "words": each.failed.words,
            }
            for each in outcomes
            if isinstance(each, Failure)
        ],
        "findings": [findings(each, labels) for each in by_design if len(each) > 1],
    }


def _swept_labels(case: LoadedCase, states: Sequence[State]) -> list[Label]:
    """The case's targets and, up to its highest harmonic, whatever else with m <= 1 was found in
    every state, by label."""
    everywhere = set.intersection(*(set(state.frequencies) for state in states))
    more = {x for x in everywhere if x.m <= 1 and x.c <= case.case.analysis.highest_harmonic}
    return sorted(
        {*(target.label for target in read_targets(case)), *more},
        key=lambda x: (x.c, x.m, x.kind or ""),
    )


def slopes(states: Sequence[State], labels: Sequence[Label]) -> dict[Label, list[float | None]]:
    """d ln f / d ln p per label at each state of one design: exact where the solver has slopes,
    else by differences of the logarithms over neighbouring pressures, of second order where there
    are three (None: there is but one)."""
    known = [state.slopes for state in states if state.slopes is not None]
    if len(known) == len(states):
        return {label: [each[label] for each in known] for label in labels}
    if len(states) == 1:
        return {label: [None] for label in labels}
    x = np.log([state.pressure_kPa for state in states])
    f = np.array([[state.frequencies[label] for label in labels] for state in states])
    table: np.ndarray = np.gradient(np.log(f), x, axis=0, edge_order=2 if len(states) > 2 else 1)
    return {label: table[:, i].tolist() for i, label in enumerate(labels)}


def _rows(states: Sequence[State], labels: Sequence[Label]) -> list[dict[str, Any]]:
    """Entries of pressure_sweep.json for the states of one design, modes by rising frequency."""
    table = slopes(states, labels)
    return [
        {
            "design": state.design,
            "pressure_kPa": state.pressure_kPa,
            "modes": [
                {**mode_entry(mode), "d_ln_f_d_ln_p": table[mode.label][k]}
                for mode in state.modes
                if mode.label in table
            ],
        }
        for k, state in enumerate(states)
    ]
