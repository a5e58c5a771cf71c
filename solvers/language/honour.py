"""Whether a block is honoured where it stands: its keyword, parameters, values and data."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

from .rule import PLACES
from .table import OUTPUT_KEYWORDS, RULES
from .text import Block


def split_steps(blocks: Iterable[Block]) -> tuple[list[Block], list[list[Block]]]:
    """The blocks of the model, and those of each step from *STEP to *END STEP. Raises the error of
    a block's place."""
    model: list[Block] = []
    steps: list[list[Block]] = []
    is_inside = False
    for block in blocks:
        if block.name == "STEP":
            if is_inside:
                raise block.refused("is inside a step: *END STEP is missing")
            steps.append([])
            is_inside = True
        elif steps and not is_inside and block.name not in OUTPUT_KEYWORDS:
            raise block.refused("is after a step: the model's keywords must be before *STEP")
        (steps[-1] if is_inside else model).append(block)
        is_inside = is_inside and block.name != "END STEP"
    if is_inside:
        raise steps[-1][0].refused("has no *END STEP: the deck is cut off")
    return model, steps


def check_honoured(block: Block, place: str) -> None:
    """Raises the error of the block's place, with what is not honoured of it and what would be.

    place: one of `PLACES`.
    """
    rule = RULES.get(block.name)
    options = rule.options_at.get(place) if rule else None
    if rule is None or options is None:
        known = [name for name, each in RULES.items() if place in each.options_at]
        close = get_close_matches(block.name, [*known, *OUTPUT_KEYWORDS], 1, 0.8)
        hint = (rule and rule.instead) or (f"did you mean *{close[0]}?" if close else "")
        if rule and rule.level == "step" and PLACES[place] != "a step":
            hint = hint or "it belongs in a step"
        raise block.refused(f"is not honoured in {PLACES[place]}" + (f"; {hint}" if hint else ""))
    for name, value in block.parameters.items():
        if name not in options:
            close = get_close_matches(name, options, 1)
            hint = f"did you mean {close[0]}?" if close else rule.instead
            words = f"the parameter {name} is not honoured" + (f"; {hint}" if hint else "")
            raise block.refused(words)
        values = options[name]
        if values is not None and value not in values:
            right = " or ".join(each or "no value" for each in values)
            raise block.refused(f"{name}={value} is not honoured, only {right}")
    if block.rows and rule.is_judged and not rule.fields:
        raise block.refused("takes no data lines", block.rows[0])
    most = len(rule.fields_of(block.parameters))
    for row in block.rows if most else ():
        if row.line.count(",") >= most:  # rarely; to part all lines takes long
            extra = [text for text in row.fields[most:] if text]
            if extra:
                raise block.refused(f"data '{extra[0]}' is not honoured", row)
