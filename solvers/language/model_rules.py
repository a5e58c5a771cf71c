"""Keywords of parts and of the model, by ABAQUS' manual; `rule` explains the notation."""

from __future__ import annotations

from .laws import INSTEAD_OF_TESTS, LAW_CONSTANTS, LAWS_NOT_READ

HONOURED_LAWS, ALL_LAWS = "; ".join(LAW_CONSTANTS), "; ".join((*LAW_CONSTANTS, *LAWS_NOT_READ))
NO_MESH = "it generates no mesh"
NO_REBAR = "it has no rebar: cords are solids of a stiff direction there"

# *DAMPING is an option of materials, but also of masses and springs: so it is under no keyword
MODEL_RULES = f"""
*HEADING (model, once a job, output)
  lines 0+: text...
  section|revolve:
*PREPRINT (model, output) ECHO=YES|NO|; MODEL=YES|NO|; HISTORY=YES|NO|; CONTACT=YES|NO|
*PART (model, in CalculiX it has no parts and instances) NAME!=+part
  deck: NAME
*ASSEMBLY (model, once a job, in CalculiX it has no parts and instances) NAME!=name
  deck: ~NAME
*INSTANCE (part, in CalculiX it has no parts and instances) NAME!=name; PART!=part; NSET=+nset;
    ELSET=+elset; INSTANCE=name; LIBRARY=name
  lines 0+: number...
  deck: NAME; PART; NSET; ELSET
*END INSTANCE, END PART, END ASSEMBLY (part)
  deck:
*NODE (part) NSET=+nset; SYSTEM=R|C|S
  lines 1+: label 6*number? as _number, _first, _second, _third
  deck: NSET; SYSTEM=R
  section: NSET
  revolve: ~NSET
*SYSTEM (part, in CalculiX {NO_MESH})
  lines 0-2: 6*number?
  deck:
*NGEN (part, in CalculiX {NO_MESH}) NSET=+nset; LINE=C|P
  lines 1+: 2*integer integer? integer? 6*number?
  deck: NSET; LINE=C
*NFILL (part, in CalculiX {NO_MESH}) NSET=+nset; BIAS=number
  lines 1+: 2*nset integer integer?
  deck: NSET; BIAS
*NCOPY (part, in CalculiX {NO_MESH}) CHANGE NUMBER!=integer; OLD SET!=nset; NEW SET=+nset; SHIFT;
    REFLECT=LINE|MIRROR|POINT; POLE; MULTIPLE=integer
  lines 0+: number...
  alone: SHIFT; REFLECT; POLE
  deck: CHANGE NUMBER; OLD SET; NEW SET; SHIFT; REFLECT=LINE; MULTIPLE
*NSET (part model) NSET!=+nset; ELSET=elset; GENERATE; UNSORTED; INTERNAL; INSTANCE=name
  lines 0+: node 15*node?
  if GENERATE: 2*integer integer?
  deck: NSET; GENERATE; UNSORTED; ~INTERNAL; INSTANCE; ELSET
  section: NSET; GENERATE
*ELEMENT (part) TYPE!=name; ELSET=+elset
  lines 1+: label node...
  deck|section: TYPE; ELSET
  revolve: TYPE=SPRING1|MASS|ROTARYI; ELSET
*ELGEN (part, in CalculiX {NO_MESH}) ELSET=+elset
  lines 1+: 2*integer 7*integer?
  deck: ELSET
*ELCOPY (part, in CalculiX {NO_MESH}) ELEMENT SHIFT!=integer; OLD SET!=elset; NEW SET=+elset; SHIFT
    NODES!=integer; REFLECT
  deck: ELEMENT SHIFT; OLD SET; NEW SET; SHIFT NODES; REFLECT
*ELSET (part model) ELSET!=+elset; GENERATE; UNSORTED; INTERNAL; INSTANCE=name
  lines 0+: element 15*element?
  if GENERATE: 2*integer integer?
  deck: ELSET; GENERATE; ~UNSORTED; ~INTERNAL; INSTANCE
  section: ELSET; GENERATE
*SURFACE (part) NAME!=+surface; INTERNAL; TYPE=ELEMENT|NODE|CYLINDER|REVOLUTION|SEGMENTS;
    FILLET RADIUS=number
  lines 0+: element? name?
  if TYPE=ELEMENT: element? name?
  if TYPE=NODE: node number?
  if TYPE=SEGMENTS: name 2*number / name 4*number?
  if TYPE=CYLINDER: 6*number / 3*number / name 2*number / name 4*number?
  if TYPE: name? name?
  deck: NAME; TYPE=ELEMENT|NODE|SEGMENTS; ~INTERNAL; ~FILLET RADIUS
  section: NAME; TYPE=ELEMENT
  revolve: NAME; TYPE=CYLINDER
*ORIENTATION (part) NAME!=+orientation; DEFINITION=name; SYSTEM=name
  lines 1+: number...
  deck: ~NAME; ~SYSTEM; ~DEFINITION
*TRANSFORM (part) NSET!=nset; TYPE=R|C|S
  lines 1: 6*number?
  instead: give degrees of freedom in r, z and twist
*SOLID SECTION (part) ELSET!=elset; MATERIAL=material; CONTROLS=controls; ORIENTATION=orientation;
    COMPOSITE
  lines 0-1: number?
  needs: MATERIAL|COMPOSITE
  deck: ELSET; MATERIAL; CONTROLS; ~ORIENTATION
  section: ELSET; MATERIAL; CONTROLS
*HOURGLASS STIFFNESS (part, under SOLID SECTION; MEMBRANE SECTION; SHELL SECTION, in CalculiX its
    hourglass control has no stiffness to set)
  lines 1: 4*number? as stiffness:stress
  deck|section:
*SECTION CONTROLS (part model, in CalculiX its hourglass control has no stiffness to set)
    NAME!=+controls; SECOND ORDER ACCURACY=YES|NO|; HOURGLASS=STIFFNESS|ENHANCED|VISCOUS|RELAX
    STIFFNESS|COMBINED
  lines 0-1: number...
  deck|section: NAME; HOURGLASS=STIFFNESS
*SURFACE SECTION (part, in CalculiX {NO_REBAR}) ELSET!=elset; DENSITY=number
  deck|section: ELSET
*MEMBRANE SECTION (part, in CalculiX {NO_REBAR}) ELSET!=elset; MATERIAL!=material;
    CONTROLS=controls; DENSITY=number; NODAL THICKNESS; MEMBRANE THICKNESS=name;
    ORIENTATION=orientation; POISSON=number
  lines 0-1: number? integer? as thickness:length
  alone: NODAL THICKNESS; MEMBRANE THICKNESS
  deck: ELSET; MATERIAL; ~POISSON=0.5
  section: ELSET; MATERIAL
*SHELL SECTION (part) ELSET!=elset; MATERIAL=material; COMPOSITE; CONTROLS=controls; DENSITY=number;
    NODAL THICKNESS; OFFSET=any; ORIENTATION=orientation; POISSON=any;
    SECTION INTEGRATION=SIMPSON|GAUSS; SHELL THICKNESS=name; THICKNESS MODULUS=number
  lines 0+: number...
  if COMPOSITE: number? integer? name any...
  needs: MATERIAL|COMPOSITE
  instead: use SFMGAX elements with a *SURFACE SECTION and *REBAR LAYER
*REBAR LAYER (part, under SURFACE SECTION; MEMBRANE SECTION; SHELL SECTION, in CalculiX {NO_REBAR})
    GEOMETRY=CONSTANT|ANGULAR|LIFT EQUATION; ORIENTATION=orientation
  lines 1+: name 3*number? material number? integer? 2*number?
  names: _name, area:area, spacing:length, _position=0, _material, angle=0
  deck|section: GEOMETRY=CONSTANT|ANGULAR
*REBAR (part, in CalculiX {NO_REBAR}) ELEMENT!=BEAM|SHELL|AXISHELL|MEMBRANE|AXIMEMBRANE|CONTINUUM;
    MATERIAL!=material; NAME=name; GEOMETRY=ISOPARAMETRIC|SKEW; ISODIRECTION=integer;
    ORIENTATION=orientation; SINGLE
  lines 1+: element any...
  if ELEMENT=AXIMEMBRANE: element number 3*number?
  names: _elements, area:area, spacing:length=1, angle=0, radius:length=0
  deck: ELEMENT=AXIMEMBRANE; MATERIAL; NAME; ~GEOMETRY
  instead: lay cords in MGAX elements, or in SFMGAX with *REBAR LAYER
*RIGID BODY (part) REF NODE!=node; TIE NSET=nset; PIN NSET=nset; ELSET=elset;
    ANALYTICAL SURFACE=surface; POSITION=INPUT|CENTER OF MASS
  lines 0+: number?
  needs: TIE NSET|PIN NSET|ELSET|ANALYTICAL SURFACE
  deck: REF NODE; TIE NSET; ELSET; ANALYTICAL SURFACE
  section: REF NODE; TIE NSET
  revolve: REF NODE; TIE NSET; ANALYTICAL SURFACE
*EMBEDDED ELEMENT (part, in CalculiX it embeds no elements) HOST ELSET=elset; ROUNDOFF
    TOLERANCE=number; EXTERIOR TOLERANCE=number; ABSOLUTE EXTERIOR TOLERANCE=number
  lines 1+: element 15*element?
  deck|section: HOST ELSET; ROUNDOFF TOLERANCE; EXTERIOR TOLERANCE; ABSOLUTE EXTERIOR TOLERANCE
*TIE (part) NAME!=name; ADJUST=YES|NO|; POSITION TOLERANCE=number;
    TYPE=SURFACE TO SURFACE|NODE TO SURFACE
  lines 1+: 2*surface
  deck: ~NAME; ADJUST=YES|NO; ~TYPE; POSITION TOLERANCE
*MASS (part) ELSET!=elset
  lines 1: number as mass
  revolve: ELSET
*ROTARY INERTIA (part) ELSET!=elset
  lines 1: 6*number? as I11, I22, I33
  revolve: ELSET
*SPRING (part) ELSET!=elset; ORIENTATION=orientation
  lines 2+: integer? integer? / number number? as stiffness
  revolve: ELSET
*MATERIAL (model) NAME!=+material
  deck|section: NAME
*DENSITY (model, once a parent, under MATERIAL)
  lines 1+: number number? as density:density
  deck|section:
*ELASTIC (model, once a parent, under MATERIAL)
    TYPE=ISOTROPIC|ORTHOTROPIC|ANISOTROPIC|ENGINEERING CONSTANTS|LAMINA|TRACTION|COUPLED TRACTION|
    SHEAR|SHORT FIBER|BILAMINA;
    MODULI=LONG TERM|INSTANTANEOUS; DEPENDENCIES=integer; COMPRESSION FACTOR=number
  lines 1+: number number? number?
  if TYPE: number...
  names TYPE=ISOTROPIC: E:stress, nu=0
  names TYPE:
  names: E:stress, nu=0
  deck|section: TYPE=ISOTROPIC; MODULI=LONG TERM
*NO COMPRESSION (model, once a parent, under MATERIAL, in CalculiX its elastic law bears compression
    and it passes over the keyword)
  deck|section:
*HYPERELASTIC (model, once a parent, under MATERIAL) {ALL_LAWS}; N=1|2|3|4|5|6;
    MODULI=LONG TERM|INSTANTANEOUS; TEST DATA INPUT; POISSON=number; BETA=any; PROPERTIES=integer;
    TYPE=any; DEPENDENCIES=integer
  lines 1+: 8*number?
  if TEST DATA INPUT, {", ".join(LAWS_NOT_READ)}:
  alone: {ALL_LAWS}
  deck|section: {HONOURED_LAWS}; N; MODULI
  instead: {INSTEAD_OF_TESTS}
*VISCOELASTIC (model, once a parent, under MATERIAL, in CalculiX its hyperelastic rubber does not
    relax) TIME=PRONY|RELAXATION TEST DATA|CREEP TEST DATA|FREQUENCY DATA|USER;
    FREQUENCY=TABULAR|FORMULA|PRONY|CREEP TEST DATA|RELAXATION TEST DATA|USER; TYPE=any;
    PRELOAD=any; NONLINEAR; ERRTOL=number; NMAX=integer
  lines 1+: 5*number?
  if TIME=PRONY: 2*number? number
  if FREQUENCY=TABULAR: 4*number? number
  if TIME, FREQUENCY, NONLINEAR:
  names TIME=PRONY: g=0, k=0, tau
  names FREQUENCY=TABULAR: shear loss=0, shear storage=0, bulk loss=0, bulk storage=0, frequency
  needs: TIME|FREQUENCY|NONLINEAR
  deck|section: TIME=PRONY; FREQUENCY=TABULAR
*DAMPING (model part step, output, not judged) ALPHA=any; BETA=any; BAND LIMITED=any;
    COMPOSITE=number; STRUCTURAL=any; DEPENDENCIES=integer
  lines 0+: number...
  section: STRUCTURAL
*ACOUSTIC MEDIUM (model, under MATERIAL) BULK MODULUS
  lines 1+: number 2*number? as bulk modulus:stress
  section: ~BULK MODULUS
*FLUID BEHAVIOR (model) NAME!=+fluid; USER
*FLUID CAVITY (part model) NAME!=name; REF NODE!=node; BEHAVIOR=fluid; MIXTURE=name;
    ADDED VOLUME=number; ADIABATIC; AMBIENT PRESSURE=number; AMBIENT TEMPERATURE=number;
    CHECK NORMALS=YES|NO; MINIMUM VOLUME=any; SURFACE=surface
  lines 0+: number?
  needs: BEHAVIOR|MIXTURE; SURFACE|ADDED VOLUME
  alone: BEHAVIOR; MIXTURE
  instead: load the surface by *DSLOAD, and set cavity.share in the case
*AMPLITUDE (model) NAME!=+amplitude;
    DEFINITION=TABULAR|EQUALLY SPACED|PERIODIC|MODULATED|DECAY|SMOOTH STEP|SOLUTION DEPENDENT|
    ACTUATOR|BUBBLE|USER;
    VALUE=RELATIVE|ABSOLUTE; TIME=STEP TIME|TOTAL TIME; SMOOTH=number
  lines 1+: number...
  deck: NAME; DEFINITION=TABULAR; TIME=STEP TIME
*SURFACE INTERACTION (part model, contact) NAME!=+interaction
  lines 0-1: number?
  revolve: NAME
*SURFACE BEHAVIOR (part model, once a parent, contact, under SURFACE INTERACTION)
    PRESSURE-OVERCLOSURE=HARD|LINEAR|EXPONENTIAL|TABULAR; NO SEPARATION; PENALTY=LINEAR|NONLINEAR|;
    DIRECT; AUGMENTED LAGRANGE
  lines 0+: number...
  if PRESSURE-OVERCLOSURE=LINEAR: number
  names: stiffness
  alone: PENALTY; DIRECT; AUGMENTED LAGRANGE
  revolve: PRESSURE-OVERCLOSURE=LINEAR
*FRICTION (part model, once a parent, contact, under SURFACE INTERACTION) ELASTIC SLIP=number;
    SLIP TOLERANCE=number; ROUGH; LAGRANGE
  lines 0+: number 3*number? as coefficient
  alone: ELASTIC SLIP; SLIP TOLERANCE; ROUGH; LAGRANGE
  revolve: ELASTIC SLIP
*CONTACT PAIR (model, contact) INTERACTION!=interaction; ADJUST=name; EXTENSION ZONE=number;
    GEOMETRIC CORRECTION=name; HCRIT=number; MIDFACE NODES=YES|NO; MINIMUM DISTANCE=YES|NO;
    NO THICKNESS; SMALL SLIDING; SMOOTH=number;
    SLIDING TRANSITION=ELEMENT ORDER SMOOTHING|LINEAR SMOOTHING|QUADRATIC SMOOTHING;
    SUPPLEMENTARY CONSTRAINTS=SELECTIVE|YES|NO; TIED; TRACKING=PATH|STATE;
    TYPE=SURFACE TO SURFACE|NODE TO SURFACE
  lines 1+: surface surface? as slave, master
  revolve: INTERACTION; TYPE=SURFACE TO SURFACE
*SYMMETRIC MODEL GENERATION (model, once a job, in CalculiX it reflects and revolves nothing)
    REVOLVE; REFLECT=LINE|PLANE; PERIODIC=name; NODE OFFSET=integer; ELEMENT OFFSET=integer;
    TRANSPORT; FILE NAME=name
  lines 1+: number...
  if REVOLVE: 6*number / 3*number / number integer? number? name?
  if REFLECT=LINE: 6*number
  if REFLECT=PLANE: 6*number / 3*number
  needs: REVOLVE|REFLECT|PERIODIC
  alone: REVOLVE; REFLECT; PERIODIC
  deck: REFLECT=LINE
  revolve: REVOLVE
*SYMMETRIC RESULTS TRANSFER (model, once a job, after SYMMETRIC MODEL GENERATION)
    STEP=integer; INC=integer; ITERATION=integer;
    UNBALANCED STRESS=name
  revolve: STEP; INC
"""
