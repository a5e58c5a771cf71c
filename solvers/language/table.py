"""The table of keywords: one record each, which all readers and checks go by."""

from __future__ import annotations

from .laws import INSTEAD_OF_TESTS
from .model_rules import MODEL_RULES
from .rule import read_rules
from .step_rules import STEP_RULES

# known by name alone, parameters and data unchecked; `rule` explains the notation
OTHER_KEYWORDS = f"""
*OUTPUT, NODE OUTPUT, ELEMENT OUTPUT, CONTACT OUTPUT, ENERGY OUTPUT, MODAL OUTPUT, NODE PRINT,
    EL PRINT, EL FILE, ENERGY PRINT, MONITOR, ENERGY FILE, CONTACT PRINT, MODAL PRINT, PRINT,
    CONTROLS, SOLVER CONTROLS, INTEGRATED OUTPUT, TIME POINTS, FILE OUTPUT, SECTION PRINT,
    SECTION FILE, FILTER, DIAGNOSTICS (model step, output, not judged)
*INTEGRATED OUTPUT SECTION (model part, output, not judged)
*CONDUCTIVITY, SPECIFIC HEAT (model, output, not judged)
*PARAMETER (model part, not judged, in CalculiX it has no parameters)
  deck:
*CAPACITY, MOLECULAR WEIGHT, PHYSICAL CONSTANTS (model, not judged)
*COUPLING, KINEMATIC, DISTRIBUTING (part model, not judged)
*MPC, EQUATION (part model, not judged)
  instead: share nodes, or *TIE surfaces of the same nodes
*MODEL CHANGE (step, not judged)
*TEMPERATURE (step, not judged)
  instead: give each material the constants of its temperature
*EXPANSION (model, not judged)
  instead: temperatures do not act here: give the shape and constants of its temperature
*INITIAL CONDITIONS (model, not judged)
  instead: the tyre starts at rest, without stress
*UNIAXIAL TEST DATA, BIAXIAL TEST DATA, PLANAR TEST DATA, VOLUMETRIC TEST DATA, SHEAR TEST DATA,
    SIMPLE SHEAR TEST DATA, COMBINED TEST DATA, USER MATERIAL (model, not judged)
  instead: {INSTEAD_OF_TESTS}
*MULLINS EFFECT (model, not judged)
  instead: give the constants of the rubber after its first loading
*HYSTERESIS (model, not judged)
  instead: give the moduli of slow loading, and *VISCOELASTIC
*UEL PROPERTY (model part, not judged)
  instead: use the elements that the manual has
*CONTACT, CONTACT INCLUSIONS, CONTACT EXCLUSIONS, CONTACT PROPERTY ASSIGNMENT,
    CONTACT INITIALIZATION ASSIGNMENT, CONTACT INITIALIZATION DATA, CONTACT FORMULATION,
    CONTACT CLEARANCE, CONTACT CLEARANCE ASSIGNMENT, CONTACT CONTROLS ASSIGNMENT,
    CONTACT STABILIZATION, CONTACT INTERFERENCE, CHANGE FRICTION, CONTACT DAMPING,
    SURFACE PROPERTY ASSIGNMENT, CLEARANCE (model part step, contact, not judged)
*PRE-TENSION SECTION (model part, not judged)
  instead: model the bead with its final stress-free shape
*DESIGN PARAMETER (model part, not judged)
  instead: give each number a mark {{{{ name }}}}, or use *PARAMETER
*MAP SOLUTION (model, not judged)
  instead: begin with the section's own inflation
"""


RULES = read_rules(MODEL_RULES + STEP_RULES + OTHER_KEYWORDS)
OUTPUT_KEYWORDS = frozenset(name for name, rule in RULES.items() if rule.is_output)
CONTACT_KEYWORDS = frozenset(name for name, rule in RULES.items() if rule.is_contact)
MATERIAL_OPTIONS = frozenset(
    name
    for name, rule in RULES.items()
    if rule.under == ("MATERIAL",) and "deck" in rule.options_at
)
