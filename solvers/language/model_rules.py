"""Keywords of parts and of the model, by ABAQUS' manual."""

from __future__ import annotations

from .laws import INSTEAD_OF_TESTS, LAW_CONSTANTS, LAWS_NOT_READ
from .rule import ANY_ROWS, MANY, ONE_ROW, KeywordRule

OF_MATERIAL = ("MATERIAL",)
OF_SECTION = ("SOLID SECTION", "MEMBRANE SECTION", "SHELL SECTION")
HOLDS_REBAR = ("SURFACE SECTION", "MEMBRANE SECTION", "SHELL SECTION")
NO_GENERATION = "it generates no mesh"
NO_PARTS = "it has no parts and instances"
NO_REBAR = "it has no rebar: cords are solids of a stiff direction there"
NO_HOURGLASS = "its hourglass control has no stiffness to set"
HYPERELASTIC_LAWS = (*LAW_CONSTANTS, *LAWS_NOT_READ)

MODEL_RULES: dict[str, KeywordRule] = {
    "HEADING": KeywordRule(
        "model",
        fields="text...",
        rows=ANY_ROWS,
        once="job",
        honoured={"section|revolve": ""},
        is_output=True,
    ),
    "PREPRINT": KeywordRule(
        "model", "ECHO=YES|NO|; MODEL=YES|NO|; HISTORY=YES|NO|; CONTACT=YES|NO|", is_output=True
    ),
    "PART": KeywordRule("model", "NAME!=+part", honoured={"deck": "NAME"}, calculix=NO_PARTS),
    "END PART": KeywordRule("part", honoured={"deck": ""}),
    "ASSEMBLY": KeywordRule(
        "model", "NAME!=name", once="job", honoured={"deck": "~NAME"}, calculix=NO_PARTS
    ),
    "END ASSEMBLY": KeywordRule("part", honoured={"deck": ""}),
    "INSTANCE": KeywordRule(
        "part",
        "NAME!=name; PART!=part; NSET=+nset; ELSET=+elset; INSTANCE=name; LIBRARY=name",
        "number...",
        rows=ANY_ROWS,
        honoured={"deck": "NAME; PART; NSET; ELSET"},
        calculix=NO_PARTS,
    ),
    "END INSTANCE": KeywordRule("part", honoured={"deck": ""}),
    "NODE": KeywordRule(
        "part",
        "NSET=+nset; SYSTEM=R|C|S",
        "label 6*number?",
        honoured={"deck": "NSET; SYSTEM=R", "section": "NSET", "revolve": "~NSET"},
    ),
    "SYSTEM": KeywordRule(
        "part", fields="6*number?", rows=(0, 2), honoured={"deck": ""}, calculix=NO_GENERATION
    ),
    "NGEN": KeywordRule(
        "part",
        "NSET=+nset; LINE=C|P",
        "2*integer integer? integer? 6*number?",
        honoured={"deck": "NSET; LINE=C"},
        calculix=NO_GENERATION,
    ),
    "NFILL": KeywordRule(
        "part",
        "NSET=+nset; BIAS=number",
        "2*nset integer integer?",
        honoured={"deck": "NSET; BIAS"},
        calculix=NO_GENERATION,
    ),
    "NCOPY": KeywordRule(
        "part",
        (
            "CHANGE NUMBER!=integer; OLD SET!=nset; NEW SET=+nset; SHIFT; "
            "REFLECT=LINE|MIRROR|POINT; POLE; MULTIPLE=integer"
        ),
        "number...",
        rows=ANY_ROWS,
        alone=("SHIFT", "REFLECT", "POLE"),
        honoured={"deck": "CHANGE NUMBER; OLD SET; NEW SET; SHIFT; REFLECT=LINE; MULTIPLE"},
        calculix=NO_GENERATION,
    ),
    "NSET": KeywordRule(
        "part model",
        "NSET!=+nset; ELSET=elset; GENERATE; UNSORTED; INTERNAL; INSTANCE=name",
        "node 15*node?",
        rows=ANY_ROWS,
        variants={"GENERATE": "2*integer integer?"},
        honoured={
            "deck": "NSET; GENERATE; UNSORTED; ~INTERNAL; INSTANCE; ELSET",
            "section": "NSET; GENERATE",
        },
    ),
    "ELEMENT": KeywordRule(
        "part",
        "TYPE!=name; ELSET=+elset",
        "label node...",
        honoured={"deck|section": "TYPE; ELSET", "revolve": "TYPE=SPRING1|MASS|ROTARYI; ELSET"},
    ),
    "ELGEN": KeywordRule(
        "part",
        "ELSET=+elset",
        "2*integer 7*integer?",
        honoured={"deck": "ELSET"},
        calculix=NO_GENERATION,
    ),
    "ELCOPY": KeywordRule(
        "part",
        "ELEMENT SHIFT!=integer; OLD SET!=elset; NEW SET=+elset; SHIFT NODES!=integer; REFLECT",
        honoured={"deck": "ELEMENT SHIFT; OLD SET; NEW SET; SHIFT NODES; REFLECT"},
        calculix=NO_GENERATION,
    ),
    "ELSET": KeywordRule(
        "part model",
        "ELSET!=+elset; GENERATE; UNSORTED; INTERNAL; INSTANCE=name",
        "element 15*element?",
        rows=ANY_ROWS,
        variants={"GENERATE": "2*integer integer?"},
        honoured={
            "deck": "ELSET; GENERATE; ~UNSORTED; ~INTERNAL; INSTANCE",
            "section": "ELSET; GENERATE",
        },
    ),
    "SURFACE": KeywordRule(
        "part",
        "NAME!=+surface; INTERNAL; TYPE=ELEMENT|NODE|CYLINDER|REVOLUTION|SEGMENTS; "
        "FILLET RADIUS=number",
        "element? name?",
        rows=ANY_ROWS,
        variants={
            "TYPE=ELEMENT": "element? name?",
            "TYPE=NODE": "node number?",
            "TYPE=SEGMENTS": ("name 2*number", "name 4*number?"),
            "TYPE=CYLINDER": ("6*number", "3*number", "name 2*number", "name 4*number?"),
            "TYPE": "name? name?",
        },
        honoured={
            "deck": "NAME; TYPE=ELEMENT|NODE|SEGMENTS; ~INTERNAL; ~FILLET RADIUS",
            "section": "NAME; TYPE=ELEMENT",
            "revolve": "NAME; TYPE=CYLINDER",
        },
    ),
    "ORIENTATION": KeywordRule(
        "part",
        "NAME!=+orientation; DEFINITION=name; SYSTEM=name",
        "number...",
        honoured={"deck": "~NAME; ~SYSTEM; ~DEFINITION"},
    ),
    "TRANSFORM": KeywordRule(
        "part",
        "NSET!=nset; TYPE=R|C|S",
        "6*number?",
        rows=ONE_ROW,
        instead="give degrees of freedom in r, z and twist",
    ),
    "SOLID SECTION": KeywordRule(
        "part",
        "ELSET!=elset; MATERIAL=material; CONTROLS=controls; ORIENTATION=orientation; COMPOSITE",
        "number?",
        rows=(0, 1),
        needs=("MATERIAL|COMPOSITE",),
        honoured={
            "deck": "ELSET; MATERIAL; CONTROLS; ~ORIENTATION",
            "section": "ELSET; MATERIAL; CONTROLS",
        },
    ),
    "HOURGLASS STIFFNESS": KeywordRule(
        "part",
        fields="4*number?",
        rows=ONE_ROW,
        under=OF_SECTION,
        honoured={"deck|section": ""},
        data="stiffness:stress",
        calculix=NO_HOURGLASS,
    ),
    "SECTION CONTROLS": KeywordRule(
        "part model",
        (
            "NAME!=+controls; SECOND ORDER ACCURACY=YES|NO|; "
            "HOURGLASS=STIFFNESS|ENHANCED|VISCOUS|RELAX STIFFNESS|COMBINED"
        ),
        "number...",
        rows=(0, 1),
        honoured={"deck|section": "NAME; HOURGLASS=STIFFNESS"},
        calculix=NO_HOURGLASS,
    ),
    "SURFACE SECTION": KeywordRule(
        "part",
        "ELSET!=elset; DENSITY=number",
        honoured={"deck|section": "ELSET"},
        calculix=NO_REBAR,
    ),
    "MEMBRANE SECTION": KeywordRule(
        "part",
        (
            "ELSET!=elset; MATERIAL!=material; CONTROLS=controls; DENSITY=number; NODAL THICKNESS; "
            "MEMBRANE THICKNESS=name; ORIENTATION=orientation; POISSON=number"
        ),
        "number? integer?",
        rows=(0, 1),
        alone=("NODAL THICKNESS", "MEMBRANE THICKNESS"),
        honoured={"deck": "ELSET; MATERIAL; ~POISSON=0.5", "section": "ELSET; MATERIAL"},
        data="thickness:length",
        calculix=NO_REBAR,
    ),
    "SHELL SECTION": KeywordRule(
        "part",
        (
            "ELSET!=elset; MATERIAL=material; COMPOSITE; CONTROLS=controls; DENSITY=number; "
            "NODAL THICKNESS; OFFSET=any; ORIENTATION=orientation; POISSON=any; "
            "SECTION INTEGRATION=SIMPSON|GAUSS; SHELL THICKNESS=name; THICKNESS MODULUS=number"
        ),
        "number...",
        rows=ANY_ROWS,
        needs=("MATERIAL|COMPOSITE",),
        variants={"COMPOSITE": "number? integer? name any..."},
        instead="use SFMGAX elements with a *SURFACE SECTION and *REBAR LAYER",
    ),
    "REBAR LAYER": KeywordRule(
        "part",
        "GEOMETRY=CONSTANT|ANGULAR|LIFT EQUATION; ORIENTATION=orientation",
        "name 3*number? material number? integer? 2*number?",
        under=HOLDS_REBAR,
        honoured={"deck|section": "GEOMETRY=CONSTANT|ANGULAR"},
        data="_name, area:area, spacing:length, _position=0, _material, angle=0",
        calculix=NO_REBAR,
    ),
    "REBAR": KeywordRule(
        "part",
        (
            "ELEMENT!=BEAM|SHELL|AXISHELL|MEMBRANE|AXIMEMBRANE|CONTINUUM; MATERIAL!=material; "
            "NAME=name; GEOMETRY=ISOPARAMETRIC|SKEW; ISODIRECTION=integer; "
            "ORIENTATION=orientation; SINGLE"
        ),
        "element any...",
        variants={"ELEMENT=AXIMEMBRANE": "element number 3*number?"},
        honoured={"deck": "ELEMENT=AXIMEMBRANE; MATERIAL; NAME; ~GEOMETRY"},
        data="_elements, area:area, spacing:length=1, angle=0, radius:length=0",
        instead="lay cords in MGAX elements, or in SFMGAX with *REBAR LAYER",
        calculix=NO_REBAR,
    ),
    "RIGID BODY": KeywordRule(
        "part",
        (
            "REF NODE!=node; TIE NSET=nset; PIN NSET=nset; ELSET=elset; "
            "ANALYTICAL SURFACE=surface; POSITION=INPUT|CENTER OF MASS"
        ),
        "number?",
        rows=ANY_ROWS,
        needs=("TIE NSET|PIN NSET|ELSET|ANALYTICAL SURFACE",),
        honoured={
            "deck": "REF NODE; TIE NSET; ELSET; ANALYTICAL SURFACE",
            "section": "REF NODE; TIE NSET",
            "revolve": "REF NODE; TIE NSET; ANALYTICAL SURFACE",
        },
    ),
    "EMBEDDED ELEMENT": KeywordRule(
        "part",
        (
            "HOST ELSET=elset; ROUNDOFF TOLERANCE=number; EXTERIOR TOLERANCE=number; "
            "ABSOLUTE EXTERIOR TOLERANCE=number"
        ),
        "element 15*element?",
        honoured={
            "deck|section": "HOST ELSET; ROUNDOFF TOLERANCE; EXTERIOR TOLERANCE; "
            "ABSOLUTE EXTERIOR TOLERANCE"
        },
        calculix="it embeds no elements",
    ),
    "TIE": KeywordRule(
        "part",
        (
            "NAME!=name; ADJUST=YES|NO|; POSITION TOLERANCE=number; "
            "TYPE=SURFACE TO SURFACE|NODE TO SURFACE"
        ),
        "2*surface",
        honoured={"deck": "~NAME; ADJUST=YES|NO; ~TYPE; POSITION TOLERANCE"},
    ),
    "MASS": KeywordRule(
        "part", "ELSET!=elset", "number", rows=ONE_ROW, honoured={"revolve": "ELSET"}, data="mass"
    ),
    "ROTARY INERTIA": KeywordRule(
        "part",
        "ELSET!=elset",
        "6*number?",
        rows=ONE_ROW,
        honoured={"revolve": "ELSET"},
        data="I11, I22, I33",
    ),
    "SPRING": KeywordRule(
        "part",
        "ELSET!=elset; ORIENTATION=orientation",
        ("integer? integer?", "number number?"),
        rows=(2, MANY),
        honoured={"revolve": "ELSET"},
        data="stiffness",
    ),
    "MATERIAL": KeywordRule("model", "NAME!=+material", honoured={"deck|section": "NAME"}),
    "DENSITY": KeywordRule(
        "model",
        fields="number number?",
        under=OF_MATERIAL,
        once="parent",
        honoured={"deck|section": ""},
        data="density:density",
    ),
    "ELASTIC": KeywordRule(
        "model",
        (
            "TYPE=ISOTROPIC|ORTHOTROPIC|ANISOTROPIC|ENGINEERING CONSTANTS|LAMINA|TRACTION|"
            "COUPLED TRACTION|SHEAR|SHORT FIBER|BILAMINA; MODULI=LONG TERM|INSTANTANEOUS; "
            "DEPENDENCIES=integer; COMPRESSION FACTOR=number"
        ),
        "number number? number?",
        under=OF_MATERIAL,
        once="parent",
        variants={"TYPE": "number..."},
        honoured={"deck|section": "TYPE=ISOTROPIC; MODULI=LONG TERM"},
        data={"TYPE=ISOTROPIC": "E:stress, nu=0", "TYPE": "", "": "E:stress, nu=0"},
    ),
    "NO COMPRESSION": KeywordRule(
        "model",
        under=OF_MATERIAL,
        once="parent",
        honoured={"deck|section": ""},
        calculix="its elastic law bears compression, and it passes over the keyword",
    ),
    "HYPERELASTIC": KeywordRule(
        "model",
        (
            f"{'; '.join(HYPERELASTIC_LAWS)}; N=1|2|3|4|5|6; MODULI=LONG TERM|INSTANTANEOUS; "
            "TEST DATA INPUT; POISSON=number; BETA=any; PROPERTIES=integer; TYPE=any; "
            "DEPENDENCIES=integer"
        ),
        "8*number?",
        alone=HYPERELASTIC_LAWS,
        under=OF_MATERIAL,
        once="parent",
        variants=dict.fromkeys(("TEST DATA INPUT", *LAWS_NOT_READ), ""),
        honoured={"deck|section": f"{'; '.join(LAW_CONSTANTS)}; N; MODULI"},
        instead=INSTEAD_OF_TESTS,
    ),
    "VISCOELASTIC": KeywordRule(
        "model",
        (
            "TIME=PRONY|RELAXATION TEST DATA|CREEP TEST DATA|FREQUENCY DATA|USER; "
            "FREQUENCY=TABULAR|FORMULA|PRONY|CREEP TEST DATA|RELAXATION TEST DATA|USER; "
            "TYPE=any; PRELOAD=any; NONLINEAR; ERRTOL=number; NMAX=integer"
        ),
        "5*number?",
        needs=("TIME|FREQUENCY|NONLINEAR",),
        under=OF_MATERIAL,
        once="parent",
        variants={
            "TIME=PRONY": "2*number? number",
            "FREQUENCY=TABULAR": "4*number? number",
            **dict.fromkeys(("TIME", "FREQUENCY", "NONLINEAR"), ""),
        },
        honoured={"deck|section": "TIME=PRONY; FREQUENCY=TABULAR"},
        data={
            "TIME=PRONY": "g=0, k=0, tau",
            "FREQUENCY=TABULAR": "shear loss=0, shear storage=0, bulk loss=0, "
            "bulk storage=0, frequency",
        },
        calculix="its hyperelastic rubber does not relax",
    ),
    # an option of materials, but also of masses and springs: so it is under no keyword
    "DAMPING": KeywordRule(
        "model part step",
        (
            "ALPHA=any; BETA=any; BAND LIMITED=any; COMPOSITE=number; STRUCTURAL=any; "
            "DEPENDENCIES=integer"
        ),
        "number...",
        rows=ANY_ROWS,
        honoured={"section": "STRUCTURAL"},
        is_output=True,
        is_judged=False,
    ),
    "ACOUSTIC MEDIUM": KeywordRule(
        "model",
        "BULK MODULUS",
        "number 2*number?",
        under=OF_MATERIAL,
        honoured={"section": "~BULK MODULUS"},  # its only form
        data="bulk modulus:stress",
    ),
    "FLUID BEHAVIOR": KeywordRule("model", "NAME!=+fluid; USER"),
    "FLUID CAVITY": KeywordRule(
        "part model",
        (
            "NAME!=name; REF NODE!=node; BEHAVIOR=fluid; MIXTURE=name; ADDED VOLUME=number; "
            "ADIABATIC; AMBIENT PRESSURE=number; AMBIENT TEMPERATURE=number; "
            "CHECK NORMALS=YES|NO; MINIMUM VOLUME=any; SURFACE=surface"
        ),
        "number?",
        rows=ANY_ROWS,
        needs=("BEHAVIOR|MIXTURE", "SURFACE|ADDED VOLUME"),
        alone=("BEHAVIOR", "MIXTURE"),
        instead="load the surface by *DSLOAD, and set cavity.share in the case",
    ),
    "AMPLITUDE": KeywordRule(
        "model",
        (
            "NAME!=+amplitude; DEFINITION=TABULAR|EQUALLY SPACED|PERIODIC|MODULATED|DECAY|"
            "SMOOTH STEP|SOLUTION DEPENDENT|ACTUATOR|BUBBLE|USER; VALUE=RELATIVE|ABSOLUTE; "
            "TIME=STEP TIME|TOTAL TIME; SMOOTH=number"
        ),
        "number...",
        honoured={"deck": "NAME; DEFINITION=TABULAR; TIME=STEP TIME"},
    ),
    "SURFACE INTERACTION": KeywordRule(
        "part model",
        "NAME!=+interaction",
        "number?",
        rows=(0, 1),
        honoured={"revolve": "NAME"},
        is_contact=True,
    ),
    "SURFACE BEHAVIOR": KeywordRule(
        "part model",
        (
            "PRESSURE-OVERCLOSURE=HARD|LINEAR|EXPONENTIAL|TABULAR; NO SEPARATION; "
            "PENALTY=LINEAR|NONLINEAR|; DIRECT; AUGMENTED LAGRANGE"
        ),
        "number...",
        rows=ANY_ROWS,
        alone=("PENALTY", "DIRECT", "AUGMENTED LAGRANGE"),
        under=("SURFACE INTERACTION",),
        once="parent",
        variants={"PRESSURE-OVERCLOSURE=LINEAR": "number"},
        honoured={"revolve": "PRESSURE-OVERCLOSURE=LINEAR"},
        data="slope",
        is_contact=True,
    ),
    "FRICTION": KeywordRule(
        "part model",
        "ELASTIC SLIP=number; SLIP TOLERANCE=number; ROUGH; LAGRANGE",
        "number 3*number?",
        rows=ANY_ROWS,
        alone=("ELASTIC SLIP", "SLIP TOLERANCE", "ROUGH", "LAGRANGE"),
        under=("SURFACE INTERACTION",),
        once="parent",
        honoured={"revolve": "ELASTIC SLIP"},
        data="coefficient",
        is_contact=True,
    ),
    "CONTACT PAIR": KeywordRule(
        "model",
        (
            "INTERACTION!=interaction; ADJUST=name; EXTENSION ZONE=number; "
            "GEOMETRIC CORRECTION=name; HCRIT=number; MIDFACE NODES=YES|NO; "
            "MINIMUM DISTANCE=YES|NO; NO THICKNESS; SMALL SLIDING; SMOOTH=number; "
            "SLIDING TRANSITION=ELEMENT ORDER SMOOTHING|LINEAR SMOOTHING|QUADRATIC SMOOTHING; "
            "SUPPLEMENTARY CONSTRAINTS=SELECTIVE|YES|NO; TIED; TRACKING=PATH|STATE; "
            "TYPE=SURFACE TO SURFACE|NODE TO SURFACE"
        ),
        "surface surface?",
        honoured={"revolve": "INTERACTION; TYPE=SURFACE TO SURFACE"},
        data="slave, master",
        is_contact=True,
    ),
    "SYMMETRIC MODEL GENERATION": KeywordRule(
        "model",
        (
            "REVOLVE; REFLECT=LINE|PLANE; PERIODIC=name; NODE OFFSET=integer; "
            "ELEMENT OFFSET=integer; TRANSPORT; FILE NAME=name"
        ),
        "number...",
        needs=("REVOLVE|REFLECT|PERIODIC",),
        alone=("REVOLVE", "REFLECT", "PERIODIC"),
        once="job",
        variants={
            "REVOLVE": ("6*number", "3*number", "number integer? number? name?"),
            "REFLECT=LINE": "6*number",
            "REFLECT=PLANE": ("6*number", "3*number"),
        },
        honoured={"deck": "REFLECT=LINE", "revolve": "REVOLVE"},
        calculix="it reflects and revolves nothing",
    ),
    "SYMMETRIC RESULTS TRANSFER": KeywordRule(
        "model",
        "STEP=integer; INC=integer; ITERATION=integer; UNBALANCED STRESS=name",
        after=("SYMMETRIC MODEL GENERATION",),
        once="job",
        honoured={"revolve": "STEP; INC"},
    ),
}
