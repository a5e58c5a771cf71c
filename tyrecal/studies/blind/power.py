"""Effects that a test could detect on a tyre, before anything is measured.

lambda of each effect over its range, by the ruler at the start design: from 25 on the studies on
record named 95 of 100, from 10 on it is seen, below 4 it is not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...units import in_engineers_units
from ..inference.model import EffectRange
from ..inference.separability import VISIBLE, smallest
from .protocol import Protocol
from .ruler import Ruler, difficulty

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
            difficulty(ruler, protocol, id, start, places, counts, g, s)
            for g, s in zip(shift, split, strict=True)
        ]
        lengths = np.array([each.lam for each in hard])
        far = hard[int(np.argmax(lengths))]
        seen, named = (smallest(sizes, lengths, least) for least in (VISIBLE, NAMED_AS_A_RULE))
        result.append(Power(id, far.lam, seen, named, far.group[1:]))
    return sorted(result, key=lambda power: -power.full)


def words(
    effect_powers: Sequence[Power],
    ruler: Ruler,
    protocol: Protocol,
    ranges: Mapping[str, EffectRange],
) -> str:
    """For people."""
    return "\n".join(_lines(effect_powers, ruler, protocol, ranges))


def _lines(
    effect_powers: Sequence[Power],
    ruler: Ruler,
    protocol: Protocol,
    ranges: Mapping[str, EffectRange],
) -> Iterator[str]:
    labels = list(dict.fromkeys(label.display for label, _ in ruler.rows if label))
    at = ", ".join(f"{p:g}" for p in protocol.given_kPa)
    yield (
        f"With {', '.join(labels)} at {at} kPa, every value to {protocol.noise:.1%} and the mass to"
        f" {protocol.mass:.1%}, you could find:"
    )
    yield ""
    yield "| effect | usually named from | detectable from | largest lambda | similar effects |"
    yield "|---|---|---|---|---|"
    for power in effect_powers:
        if power.seen is not None:
            span = ranges[power.id]
            sizes = (
                "-" if e is None else in_engineers_units(span.base + e, span.unit, 2)
                for e in (power.named, power.seen)
            )
            alike = ", ".join(power.alike)
            yield f"| `{power.id}` | {' | '.join(sizes)} | {power.full:.0f} | {alike} |"
    yield ""
    hidden = (
        ", ".join(f"`{power.id}`" for power in effect_powers if power.seen is None) or "nothing"
    )
    yield f"Not detectable at any size in their range: {hidden}."
