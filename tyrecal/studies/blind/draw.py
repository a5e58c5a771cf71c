"""Truth of each trial, drawn at random."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log1p

import numpy as np

from ...tyre.case import LoadedCase, start_values
from ...tyre.number_units import EFFECT_PATH
from ...tyre.values import with_values
from ..inference.section_fields import with_fields
from ..inference.uncertainties import Source, values_of
from .laws import EffectLaw
from .protocol import Protocol

SWAPPED_WITHIN = 0.25  # relative distance of modes whose labels could be taken for one another


@dataclass(frozen=True)
class Truth:
    """One tyre."""

    id: str  # random
    kind: str  # effect, none or outside
    law: str  # id of the effect, or name of the family outside the catalogue, "" for none
    size: float  # its parameter, in the unit of the law
    variables: dict[str, float]  # by name, in their own units
    constants: dict[str, float]  # in standard deviations
    scatter: int  # seed of noise, missing values, splits of pairs and order of their modes
    swapped: bool  # whether two labels are exchanged in its data


def draw(
    protocol: Protocol,
    case: LoadedCase,
    sources: Sequence[Source],
    laws: Mapping[str, EffectLaw],
    outside: Mapping[str, EffectLaw],
    seed: int,
) -> list[Truth]:
    """All trials, in the order of their ids, which reveals nothing.

    Effects and families have equal chances, sizes are uniform over ``smallest`` to 1 of the range,
    on either side where it has two. Variables are log-uniform within a factor 1 + ``spread`` of
    their starts; ``swapped`` is the probability that labels are exchanged.
    """
    random = np.random.default_rng(seed)
    kinds = [kind for kind, count in protocol.counts.items() for _ in range(count)]
    truths = []
    for kind in kinds:
        known = {"effect": laws, "outside": outside, "none": {}}[kind]
        law = str(random.choice(sorted(known))) if known else ""
        size = known[law].drawn(random, protocol.smallest) if law else 0.0
        width = log1p(protocol.spread)
        truths.append(
            Truth(
                random.bytes(6).hex(),
                kind,
                law,
                size,
                {
                    name: value * float(np.exp(random.uniform(-width, width)))
                    for name, value in start_values(case).items()
                },
                {source.name: float(random.normal()) for source in sources},
                int(random.integers(2**63)),
                bool(random.random() < protocol.swapped),
            )
        )
    return sorted(truths, key=lambda truth: truth.id)


def tyre(
    truth: Truth,
    case: LoadedCase,
    sources: Sequence[Source],
    pressure_kPa: float,
    law: EffectLaw | None,
) -> LoadedCase:
    """The case as this tyre is at a stated pressure, with ``law``'s effect or without.

    Raises ValueError where no such tyre can be.
    """
    plain = {**values_of(case, list(sources)), "pressure_kPa": pressure_kPa}
    values: dict[str, float] = dict(truth.variables)
    for source in sources:
        for path, step in source.steps.items():  # by one standard deviation
            known = values.get(path, 0.0 if path.startswith(EFFECT_PATH) else plain[path])
            values[path] = known + truth.constants[source.name] * step
    values.setdefault("pressure_kPa", pressure_kPa)
    made = with_fields(with_values(case, values), truth.constants)
    return law.add(made, truth.size) if law else made
