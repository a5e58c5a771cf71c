"""The blocks of a user's deck by what they are: the model, the step that inflates, what only asks
for output. What would change the answer and is not honoured is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from .text import MATERIAL_OPTIONS, OUTPUT_KEYWORDS, RULES, Block, check_honoured


@dataclass
class Sorted:
    """The blocks of a deck by what they are."""

    model: list[Block] = field(default_factory=list)
    inflation: list[Block] = field(default_factory=list)  # of the step that inflates
    passed: list[Block] = field(default_factory=list)  # over, as they change nothing
    later: list[Block] = field(default_factory=list)  # *STEP of those after it


def sort(blocks: Sequence[Block]) -> Sorted:
    """Blocks checked and sorted. Raises OwnDeckError for what is not honoured."""
    found = Sorted()
    step: list[Block] | None = None
    part = assembly = instance = False
    after_a_step = False
    over: Block | None = None  # the *MATERIAL or section that options may follow
    for block in blocks:
        name = block.name
        if step is None and name == "STEP":
            if found.inflation:
                found.later.append(block)
            if part or assembly or instance:
                raise block.refused("stands inside a *PART or *ASSEMBLY that does not end")
            step = []
        if step is not None:
            if name == "STEP" and step:
                raise block.refused("stands inside a step: *END STEP is missing")
            step.append(block)
            if name == "END STEP":
                if not found.inflation:
                    _step(step, found)
                step, after_a_step = None, True
            continue
        if name in OUTPUT_KEYWORDS:
            found.passed.append(block)
            continue
        if name in RULES and [*RULES[name].options_at] == ["deck step"]:
            raise block.refused("stands outside a step")
        if after_a_step:
            raise block.refused("stands after a step: the model's keywords stand before *STEP")
        check_honoured(block, "deck")
        found.model.append(block)
        if name in MATERIAL_OPTIONS:
            if over is None or over.name != "MATERIAL":
                raise block.refused("must follow a *MATERIAL")
        elif name == "REBAR LAYER":
            if over is None or over.name != "SURFACE SECTION":
                raise block.refused("must follow a *SURFACE SECTION")
        elif name == "HOURGLASS STIFFNESS":
            if over is None or over.name != "SOLID SECTION":
                raise block.refused("must stand right under the *SOLID SECTION that it is of")
        else:
            over = block
        if name in ("PART", "ASSEMBLY") and (part or assembly):
            raise block.refused("stands inside another *PART or *ASSEMBLY")
        if name == "INSTANCE" and (instance or not assembly):
            raise block.refused("stands in an *ASSEMBLY, not in another *INSTANCE")
        if name in ("END PART", "END ASSEMBLY", "END INSTANCE"):
            opened = {"END PART": part, "END ASSEMBLY": assembly, "END INSTANCE": instance}[name]
            if not opened or (name == "END ASSEMBLY" and instance):
                raise block.refused("ends what did not begin, or not what began last")
        part = name == "PART" or (part and name != "END PART")
        assembly = name == "ASSEMBLY" or (assembly and name != "END ASSEMBLY")
        instance = name == "INSTANCE" or (instance and name != "END INSTANCE")
        inside = part or assembly
        if inside and name in ("MATERIAL", "PARAMETER", "AMPLITUDE", "BOUNDARY"):
            raise block.refused("belongs to the model, outside *PART and *ASSEMBLY")
        if name in MATERIAL_OPTIONS and inside:
            raise block.refused("belongs to the model, outside *PART and *ASSEMBLY")
    if step is not None:
        raise step[0].refused("has no *END STEP: the deck is cut off")
    if part or assembly or instance:
        raise blocks[-1].refused("is the last, but a *PART, *ASSEMBLY or *INSTANCE has no end")
    if not found.inflation:
        raise blocks[-1].refused(
            "no *STATIC step of the deck inflates: one needs *DSLOAD or *DLOAD with a pressure"
        )
    return found


def _step(step: list[Block], found: Sorted) -> None:
    """A step up to the first that inflates, which is it or only holds nodes."""
    kept = []
    for block in step:
        if block.name in OUTPUT_KEYWORDS:
            found.passed.append(block)
        else:
            check_honoured(block, "deck step")
            kept.append(block)
    held = [block for block in kept if block.name == "BOUNDARY"]
    if new := [block for block in held if block.get("OP") == "NEW"]:
        if len(new) < len(held):
            raise new[0].refused("OP=NEW must stand at every *BOUNDARY of the step, or at none")
        found.model = [block for block in found.model if block.name != "BOUNDARY"]  # released
    procedures = [block for block in kept if block.name == "STATIC"]
    if len(procedures) != 1:
        raise step[0].refused("needs one *STATIC")
    if any(block.name in ("DSLOAD", "DLOAD") for block in kept):
        if "NLGEOM" not in step[0].parameters:
            raise step[0].refused("inflates: it needs NLGEOM=YES")
        found.inflation = kept
        return
    found.model.extend(held)  # what an earlier step holds, stays held
