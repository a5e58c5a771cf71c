"""Sentences of README and guides drawn by lot, to be checked by a command or in the code.

    python -m tests.studies.claims [--count 60] [--seed 20261128]

Draws among sentences of at least five words that have a number or state a behaviour. Of the 60 of
seed 20261128, 5 were wrong on 2026-11-27 and are mended: one start of 50 that ends elsewhere, what
a batch's pruning keeps, a truck's soft liner (stable), the shift by another law of cords, the rim
of a case of decks. Of the 60 of seed 20261203, 1 was wrong on the same day and is mended: the least
shortfall of the real tyre's predicted modes. Of the 60 of seed 20261801, 7 were wrong on the same
day and are mended: the waves from which a tyre is unstable, the sensitivity of vertical stiffness,
the first box of a sampling, numbers that cannot be variables, a total error with a prior, designs
outside an emulator's box, the tangent that antisymmetric modes on the road use. Of the 60 of seed
20262801, 6 were wrong on 2026-11-28 and are mended: the prior of a linear variable, what loads in
between change, by how much plies may be outside, where a fit goes that did not converge, the size
of a batch, what scatter repeats replace; three more were imprecise, three could not be decided. Of
the 60 of seed 20262901, 2 were wrong and 8 imprecise, and are mended: how many tries leave 6.6 %,
names of a batch's cases; of seed 20262902 the section map of a solver without exact sensitivities
and the size of a sensitivity without the rate of the state. Then every sentence of all documents,
and every row of their tables, was checked: 64 were wrong and 100 imprecise. Of the 60 of seed
20262910, 2 were wrong and 10 imprecise, and are mended: what harmonics left out amount to, and
sidewalls that the tool itself calls unusual. Of seed 20262912, 1 was wrong and 10 imprecise, and
are mended: robust verdicts that were right are those that name an effect.
"""

from __future__ import annotations

import argparse
import random
import re

from ..test_prose import DOCUMENTS, sentences

MIN_WORDS = 5
BEHAVIOUR = re.compile(
    r"""\d | \b(
    is | are | has | have | counts? | writes? | reads? | refuse[sd]? | reports? | takes? | needs?
    | prints? | gives? | stops? | follow | lists? | uses? | compares? | starts? | keeps? | finds?
    | works? | changes? | may | must | cannot | can
    )\b""",
    re.VERBOSE,
)


def draw(count: int, seed: int) -> list[tuple[str, str]]:
    """Documents and sentences of the lot."""
    every = [(name, sentence) for name in DOCUMENTS for sentence in sentences(name)]
    claims = [
        (name, sentence)
        for name, sentence in every
        if len(sentence.split()) >= MIN_WORDS and BEHAVIOUR.search(sentence)
    ]
    return random.Random(seed).sample(claims, count)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=20261128)
    options = parser.parse_args()
    for name, sentence in draw(options.count, options.seed):
        print(f"{name}: {sentence}")
