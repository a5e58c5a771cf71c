"""Keywords that are known by name alone: their parameters and data are not checked.

`rule` explains levels, ``honoured`` and ``instead``.
"""

from __future__ import annotations

from .laws import INSTEAD_OF_TESTS
from .rule import KeywordRule

SHARE_NODES = "share nodes, or *TIE surfaces of the same nodes"


def _unjudged(level: str, names: str, **more: str | bool) -> dict[str, KeywordRule]:
    """Rules of keywords of one level, by name."""
    return {name: KeywordRule(level, is_judged=False, **more) for name in names.split(", ")}  # type: ignore[arg-type]


OTHER_KEYWORDS: dict[str, KeywordRule] = {
    **_unjudged(
        "model step",
        "OUTPUT, NODE OUTPUT, ELEMENT OUTPUT, CONTACT OUTPUT, ENERGY OUTPUT, MODAL OUTPUT, "
        "NODE PRINT, EL PRINT, EL FILE, ENERGY PRINT, MONITOR, ENERGY FILE, CONTACT PRINT, "
        "MODAL PRINT, PRINT, CONTROLS, SOLVER CONTROLS, INTEGRATED OUTPUT, TIME POINTS, "
        "FILE OUTPUT, SECTION PRINT, SECTION FILE, FILTER, DIAGNOSTICS",
        is_output=True,
    ),
    **_unjudged("model part", "INTEGRATED OUTPUT SECTION", is_output=True),
    **_unjudged("model", "CONDUCTIVITY, SPECIFIC HEAT", is_output=True),
    "PARAMETER": KeywordRule(
        "model part", is_judged=False, honoured={"deck": ""}, calculix="it has no parameters"
    ),
    **_unjudged("model", "CAPACITY, MOLECULAR WEIGHT, PHYSICAL CONSTANTS"),
    **_unjudged("part model", "COUPLING, KINEMATIC, DISTRIBUTING"),
    **_unjudged("part model", "MPC, EQUATION", instead=SHARE_NODES),
    **_unjudged("step", "MODEL CHANGE"),
    **_unjudged(
        "step", "TEMPERATURE", instead="give each material the constants of its temperature"
    ),
    **_unjudged(
        "model",
        "EXPANSION",
        instead="temperatures do not act here: give the shape and constants of its temperature",
    ),
    **_unjudged("model", "INITIAL CONDITIONS", instead="the tyre starts at rest, without stress"),
    **_unjudged(
        "model",
        "UNIAXIAL TEST DATA, BIAXIAL TEST DATA, PLANAR TEST DATA, VOLUMETRIC TEST DATA, "
        "SHEAR TEST DATA, SIMPLE SHEAR TEST DATA, COMBINED TEST DATA",
        instead=INSTEAD_OF_TESTS,
    ),
    **_unjudged(
        "model",
        "MULLINS EFFECT",
        instead="give the constants of the rubber after its first loading",
    ),
    **_unjudged(
        "model", "HYSTERESIS", instead="give the moduli of slow loading, and *VISCOELASTIC"
    ),
    **_unjudged("model", "USER MATERIAL", instead=INSTEAD_OF_TESTS),
    **_unjudged("model part", "UEL PROPERTY", instead="use the elements that the manual has"),
    **_unjudged(
        "model part step",
        "CONTACT, CONTACT INCLUSIONS, CONTACT EXCLUSIONS, CONTACT PROPERTY ASSIGNMENT, "
        "CONTACT INITIALIZATION ASSIGNMENT, CONTACT INITIALIZATION DATA, CONTACT FORMULATION, "
        "CONTACT CLEARANCE, CONTACT CLEARANCE ASSIGNMENT, CONTACT CONTROLS ASSIGNMENT, "
        "CONTACT STABILIZATION, CONTACT INTERFERENCE, CHANGE FRICTION, CONTACT DAMPING, "
        "SURFACE PROPERTY ASSIGNMENT, CLEARANCE",
        is_contact=True,
    ),
    **_unjudged(
        "model part",
        "PRE-TENSION SECTION",
        instead="model the bead with its final stress-free shape",
    ),
    **_unjudged(
        "model part",
        "DESIGN PARAMETER",
        instead="give each number a mark {{ name }}, or use *PARAMETER",
    ),
    **_unjudged("model", "MAP SOLUTION", instead="begin with the section's own inflation"),
}
