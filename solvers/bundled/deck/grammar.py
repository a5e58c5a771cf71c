"""A job's deck split into its model and its steps; what the table does not list as honoured is
refused by name."""

from __future__ import annotations

from ...language.honour import check_honoured
from ...language.text import Block, DeckError


def check(keywords: list[Block], revolve: bool) -> tuple[list[Block], list[list[Block]]]:
    """Split a job into its model and its steps, refusing what is not honoured. revolve: the job
    revolves a section job, else it is one.

    Raises DeckError naming the keyword or parameter and its line.
    """
    model: list[Block] = []
    steps: list[list[Block]] = []
    inside = False
    for keyword in keywords:
        if keyword.name == "STEP":
            if inside:
                raise DeckError(keyword.place, "*STEP inside a step: *END STEP is missing")
            inside = True
            steps.append([])
        check_honoured(keyword, "step" if inside else "revolve" if revolve else "section")
        (steps[-1] if inside else model).append(keyword)
        if keyword.name == "END STEP":
            inside = False
    if inside:
        raise DeckError(steps[-1][0].place, "*STEP without *END STEP: the deck is cut off")
    formats = [keyword for keyword in keywords if keyword.name == "FILE FORMAT"]
    if len(formats) > 1:
        words = (
            f"*FILE FORMAT may be given once in a job: it is given in {formats[0].place} already"
        )
        raise DeckError(formats[1].place, words)
    return model, steps
