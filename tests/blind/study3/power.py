"""Effects that the trials of this study could show, before anything is measured.

lambda of each effect over its range, by the ruler at the start design: from 25 on the studies on
record named 95 of 100, from 10 on it is seen, below 4 it is not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tyrecal.studies.blind.protocol import Protocol
from tyrecal.studies.blind.ruler import Ruler, difficulty
from tyrecal.studies.inference.separability import VISIBLE, smallest

Array = np.ndarray
NAMED_AS_A_RULE = 25.0  # lambda


@dataclass(frozen=True)
class Power:
    """Power of a test for one effect: lambda at the far end of its range where that is larger;
    sizes from which it is seen and, as a rule, named, None beyond the range; effects that it is
    hardly told from."""

    id: str
    full: float
    seen: float | None
    named: float | None
    alike: tuple[str, ...]


def powers(ruler: Ruler, protocol: Protocol) -> list[Power]:
    """Power for every effect, the largest lambda first."""
    given = [i for i, (label, p) in enumerate(ruler.rows) if not label or p in protocol.given_kPa]
    places = np.array(given)
    labels = [ruler.rows[i][0] for i in given]
    counts = np.array([2 if label and label.c else 1 for label in labels])
    start = np.zeros(len(ruler.x0))
    result = []
    for id, signature in ruler.signatures.items():
        sizes, shift, split = signature.grid(start, places)
        hard = [
            difficulty(ruler, protocol, id, start, places, counts, moved)
            for moved in zip(shift, split, strict=True)
        ]
        lengths = np.array([each.lam for each in hard])
        far = hard[int(np.argmax(lengths))]
        seen, named = (smallest(sizes, lengths, least) for least in (VISIBLE, NAMED_AS_A_RULE))
        result.append(Power(id, far.lam, seen, named, far.group[1:]))
    return sorted(result, key=lambda power: -power.full)
