"""Keywords of parts and of the model, by ABAQUS' manual."""

from __future__ import annotations

from .rule import ANY_ROWS, MANY, NO_ROWS, ONE_ROW, Rule

OF_MATERIAL = ("MATERIAL",)
OF_SECTION = ("SOLID SECTION", "MEMBRANE SECTION", "SHELL SECTION")
HOLDS_REBAR = ("SURFACE SECTION", "MEMBRANE SECTION", "SHELL SECTION")
HYPERELASTIC_LAWS = (
    *("NEO HOOKE", "MOONEY-RIVLIN", "POLYNOMIAL", "REDUCED POLYNOMIAL", "YEOH"),
    *("ARRUDA-BOYCE", "OGDEN", "VAN DER WAALS", "MARLOW", "USER"),
)

MODEL_RULES: dict[str, Rule] = {
    "HEADING": Rule("model", fields="text...", rows=ANY_ROWS, once="job"),
    "PREPRINT": Rule(
        "model", "ECHO=YES|NO|; MODEL=YES|NO|; HISTORY=YES|NO|; CONTACT=YES|NO|", rows=NO_ROWS
    ),
    "PART": Rule("model", "NAME=+part", rows=NO_ROWS, needs=("NAME",)),
    "END PART": Rule("part", rows=NO_ROWS),
    "ASSEMBLY": Rule("model", "NAME=name", rows=NO_ROWS, needs=("NAME",), once="job"),
    "END ASSEMBLY": Rule("part", rows=NO_ROWS),
    "INSTANCE": Rule(
        "part",
        "NAME=name; PART=part; NSET=+nset; ELSET=+elset; INSTANCE=name; LIBRARY=name",
        "number...",
        rows=ANY_ROWS,
        needs=("NAME", "PART"),
    ),
    "END INSTANCE": Rule("part", rows=NO_ROWS),
    "NODE": Rule("part", "NSET=+nset; SYSTEM=R|C|S", "integer 6*number?"),
    "SYSTEM": Rule("part", fields="6*number?", rows=(0, 2)),
    "NGEN": Rule("part", "NSET=+nset; LINE=C|P", "2*integer integer? integer? 6*number?"),
    "NFILL": Rule("part", "NSET=+nset; BIAS=number", "2*nset integer integer?"),
    "NCOPY": Rule(
        "part",
        (
            "CHANGE NUMBER=integer; OLD SET=nset; NEW SET=+nset; SHIFT; "
            "REFLECT=LINE|MIRROR|POINT; POLE; MULTIPLE=integer"
        ),
        "number...",
        rows=ANY_ROWS,
        needs=("CHANGE NUMBER", "OLD SET"),
        alone=("SHIFT", "REFLECT", "POLE"),
    ),
    "NSET": Rule(
        "part model",
        "NSET=+nset; ELSET=elset; GENERATE; UNSORTED; INTERNAL; INSTANCE=name",
        "node 15*node?",
        rows=ANY_ROWS,
        needs=("NSET",),
        variants={"GENERATE": "2*integer integer?"},
    ),
    "ELEMENT": Rule("part", "TYPE=name; ELSET=+elset", "integer node...", needs=("TYPE",)),
    "ELGEN": Rule("part", "ELSET=+elset", "2*integer 7*integer?"),
    "ELCOPY": Rule(
        "part",
        "ELEMENT SHIFT=integer; OLD SET=elset; NEW SET=+elset; SHIFT NODES=integer; REFLECT",
        rows=NO_ROWS,
        needs=("ELEMENT SHIFT", "OLD SET", "SHIFT NODES"),
    ),
    "ELSET": Rule(
        "part model",
        "ELSET=+elset; GENERATE; UNSORTED; INTERNAL; INSTANCE=name",
        "element 15*element?",
        rows=ANY_ROWS,
        needs=("ELSET",),
        variants={"GENERATE": "2*integer integer?"},
    ),
    "SURFACE": Rule(
        "part",
        "NAME=+surface; INTERNAL; TYPE=ELEMENT|NODE|CYLINDER|REVOLUTION|SEGMENTS",
        "name? name?",
        rows=ANY_ROWS,
        needs=("NAME",),
        variants={
            "TYPE=ELEMENT": "element? name?",
            "TYPE=NODE": "node number?",
            "TYPE=CYLINDER": ("6*number", "3*number", "name 2*number", "name 4*number?"),
        },
    ),
    "ORIENTATION": Rule(
        "part", "NAME=+orientation; DEFINITION=name; SYSTEM=name", "number...", needs=("NAME",)
    ),
    "TRANSFORM": Rule("part", "NSET=nset; TYPE=R|C|S", "6*number?", rows=ONE_ROW, needs=("NSET",)),
    "SOLID SECTION": Rule(
        "part",
        "ELSET=elset; MATERIAL=material; CONTROLS=controls; ORIENTATION=orientation; COMPOSITE",
        "number?",
        rows=(0, 1),
        needs=("ELSET", "MATERIAL|COMPOSITE"),
    ),
    "HOURGLASS STIFFNESS": Rule("part", fields="4*number?", rows=ONE_ROW, under=OF_SECTION),
    "SECTION CONTROLS": Rule(
        "part model",
        (
            "NAME=+controls; SECOND ORDER ACCURACY=YES|NO|; "
            "HOURGLASS=STIFFNESS|ENHANCED|VISCOUS|RELAX STIFFNESS|COMBINED"
        ),
        "number...",
        rows=(0, 1),
        needs=("NAME",),
    ),
    "SURFACE SECTION": Rule("part", "ELSET=elset; DENSITY=number", rows=NO_ROWS, needs=("ELSET",)),
    "MEMBRANE SECTION": Rule(
        "part",
        (
            "ELSET=elset; MATERIAL=material; CONTROLS=controls; DENSITY=number; NODAL THICKNESS; "
            "MEMBRANE THICKNESS=name; ORIENTATION=orientation; POISSON=number"
        ),
        "number? integer?",
        rows=(0, 1),
        needs=("ELSET", "MATERIAL"),
        alone=("NODAL THICKNESS", "MEMBRANE THICKNESS"),
    ),
    "SHELL SECTION": Rule(
        "part",
        (
            "ELSET=elset; MATERIAL=material; COMPOSITE; CONTROLS=controls; DENSITY=number; "
            "NODAL THICKNESS; OFFSET=any; ORIENTATION=orientation; POISSON=any; "
            "SECTION INTEGRATION=SIMPSON|GAUSS; SHELL THICKNESS=name; THICKNESS MODULUS=number"
        ),
        "number...",
        rows=ANY_ROWS,
        needs=("ELSET", "MATERIAL|COMPOSITE"),
        variants={"COMPOSITE": "number? integer? name any..."},
    ),
    "REBAR LAYER": Rule(
        "part",
        "GEOMETRY=CONSTANT|ANGULAR|LIFT EQUATION; ORIENTATION=orientation",
        "name 3*number? material number? integer? 2*number?",
        under=HOLDS_REBAR,
    ),
    "RIGID BODY": Rule(
        "part",
        (
            "REF NODE=node; TIE NSET=nset; PIN NSET=nset; ELSET=elset; "
            "ANALYTICAL SURFACE=surface; POSITION=INPUT|CENTER OF MASS"
        ),
        "number?",
        rows=ANY_ROWS,
        needs=("REF NODE", "TIE NSET|PIN NSET|ELSET|ANALYTICAL SURFACE"),
    ),
    "EMBEDDED ELEMENT": Rule(
        "part",
        (
            "HOST ELSET=elset; ROUNDOFF TOLERANCE=number; EXTERIOR TOLERANCE=number; "
            "ABSOLUTE EXTERIOR TOLERANCE=number"
        ),
        "element 15*element?",
    ),
    "TIE": Rule(
        "part",
        (
            "NAME=name; ADJUST=YES|NO|; POSITION TOLERANCE=number; "
            "TYPE=SURFACE TO SURFACE|NODE TO SURFACE"
        ),
        "2*surface",
        needs=("NAME",),
    ),
    "MASS": Rule("part", "ELSET=elset", "number", rows=ONE_ROW, needs=("ELSET",)),
    "ROTARY INERTIA": Rule("part", "ELSET=elset", "6*number?", rows=ONE_ROW, needs=("ELSET",)),
    "SPRING": Rule(
        "part",
        "ELSET=elset; ORIENTATION=orientation",
        ("integer? integer?", "number number?"),
        rows=(2, MANY),
        needs=("ELSET",),
    ),
    "MATERIAL": Rule("model", "NAME=+material", rows=NO_ROWS, needs=("NAME",)),
    "DENSITY": Rule("model", fields="number number?", under=OF_MATERIAL, once="parent"),
    "ELASTIC": Rule(
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
    ),
    "NO COMPRESSION": Rule("model", rows=NO_ROWS, under=OF_MATERIAL, once="parent"),
    "HYPERELASTIC": Rule(
        "model",
        (
            "NEO HOOKE; MOONEY-RIVLIN; POLYNOMIAL; REDUCED POLYNOMIAL; YEOH; ARRUDA-BOYCE; "
            "OGDEN; VAN DER WAALS; MARLOW; USER; N=1|2|3|4|5|6; MODULI=LONG TERM|INSTANTANEOUS"
        ),
        "8*number?",
        alone=HYPERELASTIC_LAWS,
        under=OF_MATERIAL,
        once="parent",
    ),
    "VISCOELASTIC": Rule(
        "model",
        "TIME=PRONY; FREQUENCY=TABULAR|FORMULA|PRONY",
        "5*number?",
        needs=("TIME|FREQUENCY",),
        under=OF_MATERIAL,
        once="parent",
        variants={"TIME=PRONY": "2*number? number", "FREQUENCY=TABULAR": "4*number? number"},
    ),
    "ACOUSTIC MEDIUM": Rule("model", "BULK MODULUS", "number 2*number?", under=OF_MATERIAL),
    "FLUID BEHAVIOR": Rule("model", "NAME=+fluid; USER", rows=NO_ROWS, needs=("NAME",)),
    "FLUID CAVITY": Rule(
        "part model",
        (
            "NAME=name; REF NODE=node; BEHAVIOR=fluid; MIXTURE=name; ADDED VOLUME=number; "
            "ADIABATIC; AMBIENT PRESSURE=number; AMBIENT TEMPERATURE=number; "
            "CHECK NORMALS=YES|NO; MINIMUM VOLUME=any; SURFACE=surface"
        ),
        "number?",
        rows=ANY_ROWS,
        needs=("NAME", "REF NODE", "BEHAVIOR|MIXTURE", "SURFACE|ADDED VOLUME"),
        alone=("BEHAVIOR", "MIXTURE"),
    ),
    "AMPLITUDE": Rule(
        "model",
        (
            "NAME=+amplitude; DEFINITION=TABULAR|EQUALLY SPACED|PERIODIC|MODULATED|DECAY|"
            "SMOOTH STEP|SOLUTION DEPENDENT|ACTUATOR|BUBBLE|USER; VALUE=RELATIVE|ABSOLUTE; "
            "TIME=STEP TIME|TOTAL TIME; SMOOTH=number"
        ),
        "number...",
        needs=("NAME",),
    ),
    "SURFACE INTERACTION": Rule(
        "part model", "NAME=+interaction", "number?", rows=(0, 1), needs=("NAME",)
    ),
    "SURFACE BEHAVIOR": Rule(
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
    ),
    "FRICTION": Rule(
        "part model",
        "ELASTIC SLIP=number; SLIP TOLERANCE=number; ROUGH; LAGRANGE",
        "number 3*number?",
        rows=ANY_ROWS,
        alone=("ELASTIC SLIP", "SLIP TOLERANCE", "ROUGH", "LAGRANGE"),
        under=("SURFACE INTERACTION",),
        once="parent",
    ),
    "CONTACT PAIR": Rule(
        "model",
        (
            "INTERACTION=interaction; ADJUST=name; SMALL SLIDING; "
            "TYPE=SURFACE TO SURFACE|NODE TO SURFACE"
        ),
        "surface surface?",
        needs=("INTERACTION",),
    ),
    "SYMMETRIC MODEL GENERATION": Rule(
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
    ),
    "SYMMETRIC RESULTS TRANSFER": Rule(
        "model",
        "STEP=integer; INC=integer; ITERATION=integer; UNBALANCED STRESS=name",
        rows=NO_ROWS,
        after=("SYMMETRIC MODEL GENERATION",),
        once="job",
    ),
}
