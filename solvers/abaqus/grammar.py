"""What ABAQUS' Keywords Reference says of the keywords that tyres' decks are made of.

The manual's sentences, none of them tried by a run.
"""

from __future__ import annotations

from ..language.table import RULES as RULES

# that ask for output, say how to iterate, or that we never write: their parameters and data are
# not judged
UNJUDGED = {
    **dict.fromkeys(
        (
            *("OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT", "ENERGY OUTPUT"),
            *("MODAL OUTPUT", "NODE PRINT", "EL PRINT", "EL FILE", "ENERGY PRINT", "MONITOR"),
            *("ENERGY FILE", "CONTACT PRINT", "MODAL PRINT", "PRINT", "CONTROLS"),
            *("SOLVER CONTROLS", "INTEGRATED OUTPUT", "TIME POINTS"),
        ),
        "model step",
    ),
    "PARAMETER": "model part",
    # of decks in three dimensions
    **dict.fromkeys(("EXPANSION", "CAPACITY", "MOLECULAR WEIGHT"), "model"),
    **dict.fromkeys(("INITIAL CONDITIONS", "PHYSICAL CONSTANTS"), "model"),
    **dict.fromkeys(("MPC", "EQUATION", "COUPLING", "KINEMATIC", "DISTRIBUTING"), "part model"),
    **dict.fromkeys(("TEMPERATURE", "MODEL CHANGE"), "step"),
}
