"""What is honoured of a user's deck, what is passed over because it only asks for output, and what
stands where. All else would change the answer, and is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches

from .text import NO_ROWS, RULES, Block

Values = tuple[str, ...] | None  # that a parameter may have; None: any, "": without one

MESH: dict[str, dict[str, Values]] = {
    "NODE": {"NSET": None, "SYSTEM": ("R",)},
    "SYSTEM": {},
    "NGEN": {"NSET": None, "LINE": ("C",)},
    "NFILL": {"NSET": None, "BIAS": None},
    "NCOPY": {
        "CHANGE NUMBER": None,
        "OLD SET": None,
        "NEW SET": None,
        "SHIFT": ("",),
        "REFLECT": ("LINE",),
        "MULTIPLE": None,
    },
    "NSET": {
        "NSET": None,
        "GENERATE": ("",),
        "UNSORTED": ("",),
        "INTERNAL": ("",),
        "INSTANCE": None,
        "ELSET": None,
    },
    "ELEMENT": {"TYPE": None, "ELSET": None},
    "ELGEN": {"ELSET": None},
    "ELCOPY": {
        "ELEMENT SHIFT": None,
        "OLD SET": None,
        "NEW SET": None,
        "SHIFT NODES": None,
        "REFLECT": ("",),
    },
    "ELSET": {
        "ELSET": None,
        "GENERATE": ("",),
        "UNSORTED": ("",),
        "INTERNAL": ("",),
        "INSTANCE": None,
    },
    "SURFACE": {"NAME": None, "TYPE": ("ELEMENT", "NODE"), "INTERNAL": ("",)},
    "SOLID SECTION": {"ELSET": None, "MATERIAL": None, "CONTROLS": None, "ORIENTATION": None},
    "HOURGLASS STIFFNESS": {},
    "SURFACE SECTION": {"ELSET": None},
    "REBAR LAYER": {"GEOMETRY": ("CONSTANT", "ANGULAR")},
    "RIGID BODY": {"REF NODE": None, "TIE NSET": None, "ELSET": None},
    "EMBEDDED ELEMENT": {
        "HOST ELSET": None,
        "ROUNDOFF TOLERANCE": None,
        "EXTERIOR TOLERANCE": None,
        "ABSOLUTE EXTERIOR TOLERANCE": None,
    },
    "TIE": {"NAME": None, "ADJUST": ("YES", "NO"), "TYPE": None, "POSITION TOLERANCE": None},
    "ORIENTATION": {"NAME": None, "SYSTEM": None, "DEFINITION": None},
}
MATERIAL: dict[str, dict[str, Values]] = {
    "DENSITY": {},
    "ELASTIC": {"TYPE": ("ISOTROPIC",), "MODULI": ("LONG TERM",)},
    "HYPERELASTIC": {
        "NEO HOOKE": ("",),
        "MOONEY-RIVLIN": ("",),
        "REDUCED POLYNOMIAL": ("",),
        "YEOH": ("",),
        "POLYNOMIAL": ("",),
        "ARRUDA-BOYCE": ("",),
        "OGDEN": ("",),
        "N": ("1", "2", "3", "4", "5", "6"),
        "MODULI": ("LONG TERM", "INSTANTANEOUS"),
    },
    "NO COMPRESSION": {},
    "VISCOELASTIC": {"TIME": ("PRONY",), "FREQUENCY": ("TABULAR",)},
}
MODEL_LEVEL: dict[str, dict[str, Values]] = {
    "PARAMETER": {},
    "PART": {"NAME": None},
    "END PART": {},
    "ASSEMBLY": {"NAME": None},
    "END ASSEMBLY": {},
    "INSTANCE": {"NAME": None, "PART": None, "NSET": None, "ELSET": None},
    "END INSTANCE": {},
    "SECTION CONTROLS": {"NAME": None, "HOURGLASS": ("STIFFNESS",)},
    "MATERIAL": {"NAME": None},
    "BOUNDARY": {"OP": ("MOD", "NEW")},
    "AMPLITUDE": {"NAME": None, "DEFINITION": ("TABULAR",), "TIME": ("STEP TIME",)},
    "SYMMETRIC MODEL GENERATION": {"REFLECT": ("LINE",)},
}
STEP_LEVEL: dict[str, dict[str, Values]] = {
    "STEP": {
        "NAME": None,
        "NLGEOM": ("YES", ""),
        "INC": None,
        "EXTRAPOLATION": ("LINEAR", "PARABOLIC", "NO"),
        "UNSYMM": ("YES", "NO"),
        "CONVERT SDI": ("YES", "NO"),
    },
    "STATIC": {"LONG TERM": ("",), "DIRECT": ("",)},
    "BOUNDARY": {"OP": ("MOD", "NEW"), "AMPLITUDE": None},
    "DSLOAD": {"OP": ("MOD", "NEW"), "AMPLITUDE": None},
    "DLOAD": {"OP": ("MOD", "NEW"), "AMPLITUDE": None},
    "END STEP": {},
}
# that ask for output or a listing, or only say how to iterate: they are taken in any level
NO_EFFECT = {
    *("HEADING", "PREPRINT", "RESTART", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "MONITOR"),
    *("CONTACT OUTPUT", "ENERGY OUTPUT", "MODAL OUTPUT", "NODE PRINT", "EL PRINT", "NODE FILE"),
    *("EL FILE", "ENERGY PRINT", "ENERGY FILE", "CONTACT PRINT", "CONTACT FILE", "MODAL FILE"),
    *("MODAL PRINT", "FILE FORMAT", "FILE OUTPUT", "PRINT", "SECTION PRINT", "SECTION FILE"),
    *("INTEGRATED OUTPUT", "INTEGRATED OUTPUT SECTION", "FILTER", "TIME POINTS", "CONTROLS"),
    *("SOLVER CONTROLS", "DIAGNOSTICS", "DAMPING", "CONDUCTIVITY", "SPECIFIC HEAT"),
}
INSTEAD = {  # what would do in place of keywords that are often met
    "HYSTERESIS": "delete it: the long-term state and its small vibrations do not have it",
    "CONTACT PAIR": "share the bead's nodes with the rim, or *TIE it: a fixed bead is honoured",
    "CONTACT": "share the bead's nodes with the rim, or *TIE it: a fixed bead is honoured",
    "MEMBRANE SECTION": "use SFMGAX elements with a *SURFACE SECTION and *REBAR LAYER",
    "REBAR": "use SFMGAX elements with a *SURFACE SECTION and *REBAR LAYER",
    "SHELL SECTION": "use SFMGAX elements with a *SURFACE SECTION and *REBAR LAYER",
    "TRANSFORM": "give degrees of freedom in r, z and twist",
    "MPC": "share nodes, or *TIE surfaces of the same nodes",
    "EQUATION": "share nodes, or *TIE surfaces of the same nodes",
    "EXPANSION": "delete it: no temperature changes here",
    "TEMPERATURE": "give each material the constants of its temperature",
    "INITIAL CONDITIONS": "delete it: the tyre starts at rest, without stress",
    "CLOAD": "delete it: only the inflation pressure acts",
    "FLUID CAVITY": "load the surface by *DSLOAD, and set cavity.share in the case",
    "PRE-TENSION SECTION": "delete it, or model the bead with its final stress-free shape",
    "DESIGN PARAMETER": "give each number a mark {{ name }}, or use *PARAMETER",
    "MAP SOLUTION": "begin with the section's own inflation",
    "USER MATERIAL": "write a *HYPERELASTIC that fits the same tests",
    "UEL PROPERTY": "use the elements that the manual has",
}


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
        if name in NO_EFFECT:
            found.passed.append(block)
            continue
        if name in ("END STEP", *STEP_LEVEL) and name != "BOUNDARY":
            raise block.refused("stands outside a step")
        if after_a_step:
            raise block.refused("stands after a step: the model's keywords stand before *STEP")
        _check(block, {**MESH, **MATERIAL, **MODEL_LEVEL}, "the model")
        found.model.append(block)
        if name in MATERIAL:
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
        if name in MATERIAL and inside:
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
        if block.name in NO_EFFECT:
            found.passed.append(block)
        else:
            _check(block, STEP_LEVEL, "a step")
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


def _check(block: Block, known: dict[str, dict[str, Values]], where: str) -> None:
    if block.name not in known:
        close = get_close_matches(block.name, [*known, *NO_EFFECT], 1, 0.8)
        hint = INSTEAD.get(block.name) or (f"did you mean *{close[0]}?" if close else "")
        hint = hint or "delete it where it changes nothing"
        raise block.refused(f"is not honoured in {where}; {hint}")
    rule = RULES.get(block.name)
    if block.rows and rule and rule.rows == NO_ROWS:
        raise block.refused("takes no data lines", block.rows[0])
    parameters = known[block.name]
    for name, value in block.parameters.items():
        if name not in parameters:
            close = get_close_matches(name, parameters, 1)
            hint = f"; did you mean {close[0]}?" if close else ""
            raise block.refused(f"the parameter {name} is not honoured{hint}")
        values = parameters[name]
        if values is not None and value not in values:
            expected = " or ".join(v or "no value" for v in values)
            raise block.refused(f"{name}={value} is not honoured, only {expected}")
        if values is None and not value:
            raise block.refused(f"{name} needs a value")
