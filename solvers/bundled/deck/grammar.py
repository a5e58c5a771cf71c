"""A job's deck split into its model and its steps; what the table does not list as honoured is
refused by name."""

from __future__ import annotations

from ...language.honour import check_honoured, split_steps
from ...language.text import Block


def check(keywords: list[Block], revolve: bool) -> tuple[list[Block], list[list[Block]]]:
    """Split a job into its model and its steps, refusing what is not honoured. revolve: the job
    revolves a section job, else it is one. Raises DeckError naming the keyword or parameter and its
    line."""
    model, steps = split_steps(keywords)
    places = ["revolve" if revolve else "section", *["step"] * len(steps)]
    for place, blocks in zip(places, (model, *steps), strict=True):
        for block in blocks:
            check_honoured(block, place)
    formats = [keyword for keyword in keywords if keyword.name == "FILE FORMAT"]
    if len(formats) > 1:
        first = formats[0].place
        raise formats[1].refused(f"may be given once in a job: it is given in {first} already")
    return model, steps
