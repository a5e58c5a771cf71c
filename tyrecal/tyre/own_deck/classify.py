"""The blocks of a user's deck by what they are: the model, the step that inflates, what only asks
for output. What would change the answer and is not honoured is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .numbers import plain_number
from .text import Block, check_honoured, split_steps, table

LOADS = ("DSLOAD", "DLOAD")


@dataclass
class ClassifiedDeck:
    """The blocks of a deck by what they are."""

    # before the steps, and what steps before the inflation hold
    model: list[Block] = field(default_factory=list)
    options: dict[Block, list[Block]] = field(default_factory=dict)  # by material or section
    inflation: list[Block] = field(default_factory=list)  # of the step that inflates
    passed: list[Block] = field(default_factory=list)  # requests of output, which change nothing
    contact: list[Block] = field(default_factory=list)  # superfluous where the bead is held
    later: list[Block] = field(default_factory=list)  # *STEP of those after it
    is_nonlinear: bool = False  # NLGEOM, which stays on in later steps


def classify(blocks: Sequence[Block]) -> ClassifiedDeck:
    """Blocks checked and classified. Raises OwnDeckError for what is not honoured."""
    deck = ClassifiedDeck()
    model, steps = split_steps(blocks)
    opened: list[str] = []  # *PART, *ASSEMBLY and *INSTANCE that have not ended
    over: Block | None = None  # the *MATERIAL or section that options may follow
    for block in _acting(model, deck):
        name = block.name
        check_honoured(block, "deck")
        rule = table.RULES[name]  # ABAQUS' manual on the keyword
        deck.model.append(block)
        if not rule.under:
            over = block
        elif over is None or over.name not in rule.under:
            raise block.refused(f"must be under a *{' or *'.join(rule.under)}")
        else:
            deck.options.setdefault(over, []).append(block)
        if opened and "part" not in rule.level.split():
            raise block.refused("belongs to the model, outside *PART and *ASSEMBLY")
        if name == "INSTANCE" and opened != ["ASSEMBLY"]:
            raise block.refused("must be in an *ASSEMBLY, not in another *INSTANCE")
        if name in ("PART", "ASSEMBLY", "INSTANCE"):
            opened.append(name)
        elif name in ("END PART", "END ASSEMBLY", "END INSTANCE"):
            if opened[-1:] != [name.removeprefix("END ")]:
                raise block.refused("ends what did not begin, or not what began last")
            opened.pop()
    if opened:
        raise model[-1].refused("is the last, but a *PART, *ASSEMBLY or *INSTANCE has no end")
    inflating = _last_that_raises_the_pressure(steps)
    for k, each in enumerate(steps[: len(steps) if inflating is None else inflating + 1]):
        _step(each, deck, is_inflation=k == inflating)
    if inflating is None:
        raise blocks[-1].refused(
            "no *STATIC step inflates: give it a pressure by *DSLOAD or *DLOAD"
        )
    deck.later = [each[0] for each in steps[inflating + 1 :]]
    return deck


def _acting(blocks: Sequence[Block], deck: ClassifiedDeck) -> list[Block]:
    """The blocks that are neither output nor contact; those are noted."""
    deck.passed += [block for block in blocks if block.name in table.OUTPUT_KEYWORDS]
    deck.contact += [block for block in blocks if block.name in table.CONTACT_KEYWORDS]
    noted = table.OUTPUT_KEYWORDS | table.CONTACT_KEYWORDS
    return [block for block in blocks if block.name not in noted]


def _last_that_raises_the_pressure(steps: Sequence[Sequence[Block]]) -> int | None:
    """Place of the step that inflates; None if there is none. Equilibrium depends on the last
    pressure alone, so steps that seat the beads at a lower one count no more. Steps that load other
    surfaces, or by a mark, come after the inflation."""
    chosen: int | None = None
    before: dict[tuple[str, str], float] | None = None
    for place, step in enumerate(steps):
        loads = [block for block in step if block.name in LOADS]
        if not loads:
            continue
        now = _pressures(loads)
        if chosen is None:
            chosen, before = place, now
        elif now and before and now.keys() == before.keys():
            if max(now.values()) > max(before.values()):
                chosen = place
            before = now
        else:
            break
    return chosen


def _pressures(loads: Sequence[Block]) -> dict[tuple[str, str], float] | None:
    """Pressures of a step by surface and kind of load; None if one is no plain number."""
    rows = [row for block in loads for row in block.rows]
    if not rows or not all(plain_number(row.text(2)) for row in rows):
        return None
    return {(row.name(0), row.name(1)): row.number(2) for row in rows}


def _step(step: list[Block], deck: ClassifiedDeck, is_inflation: bool) -> None:
    """A step up to the one that inflates: of those before it, what they hold stays held."""
    kept = _acting(step, deck)
    for block in kept:
        if is_inflation or block.name != "STATIC":  # how earlier steps go is no matter
            check_honoured(block, "deck step")
    held = [block for block in kept if block.name == "BOUNDARY"]
    if new := [block for block in held if block.get("OP") == "NEW"]:
        if len(new) < len(held):
            raise new[0].refused("OP=NEW must be at every *BOUNDARY of the step, or at none")
        deck.model = [block for block in deck.model if block.name != "BOUNDARY"]  # released
    procedures = [block for block in kept if block.name == "STATIC"]
    if len(procedures) != 1:
        raise step[0].refused("needs one *STATIC")
    deck.is_nonlinear |= "NLGEOM" in step[0].parameters
    if not is_inflation:
        moved = [block for block in held if any(row.number(3, 0.0) for row in block.rows)]
        _check_amplitudes(deck, moved, procedures[0])
        deck.model.extend(held)
        return
    if not deck.is_nonlinear:
        raise step[0].refused("inflates: it needs NLGEOM=YES")
    _check_amplitudes(deck, kept, procedures[0])
    deck.inflation = kept


def _check_amplitudes(deck: ClassifiedDeck, blocks: Sequence[Block], static: Block) -> None:
    """Refuse an amplitude that is not 1 at the end of the step's time (by default 1)."""
    tables = {block.need("NAME"): block for block in deck.model if block.name == "AMPLITUDE"}
    for block in blocks:
        name = block.get("AMPLITUDE")
        if not name:
            continue
        if name not in tables:
            raise block.refused(f"the amplitude {name} is not defined")
        table = tables[name]
        numbers = [row.number(i) for row in table.rows for i, text in enumerate(row.fields) if text]
        period = static.rows[0].number(1, 1.0) if static.rows else 1.0
        if len(numbers) < 2 or len(numbers) % 2:
            raise table.refused("holds pairs of time and amplitude")
        end = float(np.interp(period, numbers[::2], numbers[1::2]))
        if end != 1.0:
            raise block.refused(f"the amplitude {name} ends at {end:g}, it must end at 1")
