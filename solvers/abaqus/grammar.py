"""What ABAQUS' Keywords Reference says of the keywords that tyres' decks are made of.

Of each: the level it belongs to, its parameters, what it must stand under, come after or have, how
often it may stand, and its data lines. The manual's sentences, none of them tried by a run.

Levels: ``part`` is a part, an instance, the assembly, or a model that has no parts. Parameters:
``NAME`` takes no value, ``NAME=ONE|TWO`` these (an empty one: none), ``NAME=kind`` a kind, and
``NAME=+kind`` gives a name of it. Fields of a data line: kinds, ``3*number`` three of them,
``number?`` may be blank, ``node...`` none or more.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

Fields = str | tuple[str, ...]  # of every line, or of the first lines and then of all others


@dataclass(frozen=True)
class Rule:
    """Of one keyword.

    options: its parameters; needs: of each, split at |, one must be given; alone: those that
    exclude each other; under: keywords of which it is an option; after: of which one must stand
    before it, or in the job that it goes on from; within: procedures of the steps that it belongs
    to; once: in the ``job``, the ``step`` or its ``parent``; rows: how few and how many data lines;
    variants: their fields where a parameter is given that changes them.
    """

    level: str
    options: str = ""
    fields: Fields = ""
    rows: tuple[int, int] = (1, 10**9)
    needs: tuple[str, ...] = ()
    alone: tuple[str, ...] = ()
    under: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    within: tuple[str, ...] = ()
    once: str = ""
    variants: Mapping[str, Fields] = field(default_factory=dict)

    @cached_property
    def parameters(self) -> dict[str, str]:
        """What each may be: words in capitals, split at |, or a kind."""
        pairs = (option.partition("=") for option in self.options.split("; ") if option)
        return {name: value for name, _, value in pairs}


MANY = 10**9
NO_ROWS, ONE_ROW, ANY_ROWS = (0, 0), (1, 1), (0, MANY)
OF_MATERIAL = ("MATERIAL",)
OF_SECTION = ("SOLID SECTION", "MEMBRANE SECTION", "SHELL SECTION")
HOLDS_REBAR = ("SURFACE SECTION", "MEMBRANE SECTION", "SHELL SECTION")
HYPERELASTIC_LAWS = (
    *("NEO HOOKE", "MOONEY-RIVLIN", "POLYNOMIAL", "REDUCED POLYNOMIAL", "YEOH"),
    *("ARRUDA-BOYCE", "OGDEN", "VAN DER WAALS", "MARLOW", "USER"),
)
EXTRACTION = ("FREQUENCY", "BUCKLE", "COMPLEX FREQUENCY")
STEP_PROCEDURES = (
    *("STATIC", *EXTRACTION, "DYNAMIC", "STEADY STATE TRANSPORT", "VISCO"),
    *("STEADY STATE DYNAMICS", "MODAL DYNAMIC"),
)

RULES: dict[str, Rule] = {
    "HEADING": Rule("model", fields="text...", rows=ANY_ROWS, once="job"),
    "PREPRINT": Rule(
        "model", "ECHO=YES|NO|; MODEL=YES|NO|; HISTORY=YES|NO|; CONTACT=YES|NO|", rows=NO_ROWS
    ),
    "PART": Rule("model", "NAME=+part", rows=NO_ROWS, needs=("NAME",)),
    "END PART": Rule("part", rows=NO_ROWS),
    "ASSEMBLY": Rule("model", "NAME=name", rows=NO_ROWS, needs=("NAME",), once="job"),
    "END ASSEMBLY": Rule("part", rows=NO_ROWS),
    "INSTANCE": Rule(
        "part", "NAME=name; PART=part", "number...", rows=ANY_ROWS, needs=("NAME", "PART")
    ),
    "END INSTANCE": Rule("part", rows=NO_ROWS),
    "NODE": Rule("part", "NSET=+nset; SYSTEM=R|C|S", "integer number 5*number?"),
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
        "NAME=+controls; SECOND ORDER ACCURACY=YES|NO|; HOURGLASS=STIFFNESS|ENHANCED",
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
        "TYPE=name; MODULI=LONG TERM|INSTANTANEOUS",
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
        "number 7*number?",
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
        variants={"TIME=PRONY": "3*number", "FREQUENCY=TABULAR": "5*number"},
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
            "NAME=+amplitude; DEFINITION=name; VALUE=RELATIVE|ABSOLUTE; "
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
    "RESTART": Rule(
        "model step",
        (
            "WRITE; READ; FREQUENCY=integer; NUMBER INTERVAL=integer; OVERLAY; "
            "TIME MARKS=YES|NO|; STEP=integer; INC=integer; END STEP"
        ),
        rows=NO_ROWS,
        needs=("WRITE|READ",),
        alone=("FREQUENCY", "NUMBER INTERVAL"),
    ),
    "BOUNDARY": Rule(
        "model step",
        "OP=MOD|NEW; AMPLITUDE=amplitude; TYPE=DISPLACEMENT|VELOCITY|ACCELERATION; FIXED",
        "node freedom integer? number?",
    ),
    "STEP": Rule(
        "model",
        (
            "NAME=name; NLGEOM=YES|NO|; INC=integer; PERTURBATION; "
            "EXTRAPOLATION=LINEAR|PARABOLIC|NO; UNSYMM=YES|NO; AMPLITUDE=STEP|RAMP; "
            "CONVERT SDI=YES|NO"
        ),
        "text...",
        rows=ANY_ROWS,
    ),
    "STATIC": Rule(
        "step",
        (
            "LONG TERM; DIRECT=|NO STOP; STABILIZE=any; RIKS; FACTOR=number; ALLSDTOL=number; "
            "CONTINUE=YES|NO|"
        ),
        "4*number?",
        rows=(0, 2),
        once="step",
    ),
    "FREQUENCY": Rule(
        "step",
        (
            "EIGENSOLVER=LANCZOS|SUBSPACE|AMS; PROPERTY EVALUATION=number; "
            "NORMALIZATION=MASS|DISPLACEMENT; SIM=YES|NO|; ACOUSTIC COUPLING=ON|OFF|PROJECTION; "
            "RESIDUAL MODES; NUMBER INTERVAL=integer; BIAS=number"
        ),
        "integer? 6*number?",
        once="step",
    ),
    "COMPLEX FREQUENCY": Rule(
        "step",
        (
            "PROPERTY EVALUATION=number; FRICTION DAMPING=YES|NO; "
            "NORMALIZATION=DISPLACEMENT|MODAL; UNSTABLE MODES ONLY=name; LEFT EIGENVECTORS; "
            "RIGHT EIGENVECTORS"
        ),
        "integer? 5*number?",
        rows=ONE_ROW,
        after=("FREQUENCY",),
        once="step",
    ),
    "DSLOAD": Rule(
        "step",
        "OP=MOD|NEW; AMPLITUDE=amplitude; FOLLOWER=YES|NO|; CONSTANT RESULTANT=YES|NO|",
        "surface name 7*number?",
    ),
    "DLOAD": Rule("step", "OP=MOD|NEW; AMPLITUDE=amplitude", "element name 7*number?"),
    "CLOAD": Rule("step", "OP=MOD|NEW; AMPLITUDE=amplitude; FOLLOWER", "node integer number"),
    "CONTACT CONTROLS": Rule(
        "step",
        (
            "SLAVE=surface; MASTER=surface; STABILIZE=any; RESET; TANGENT FRACTION=number; "
            "STIFFNESS SCALE FACTOR=number"
        ),
        "3*number?",
        rows=(0, 2),
    ),
    "FILE FORMAT": Rule("model step", "ASCII; ZERO INCREMENT", rows=NO_ROWS, once="job"),
    "NODE FILE": Rule(
        "step",
        "FREQUENCY=integer; NSET=nset; GLOBAL=YES|NO|; MODE=integer; LAST MODE=integer",
        "name...",
        rows=ANY_ROWS,
    ),
    "MODAL FILE": Rule("step", "FREQUENCY=integer", rows=NO_ROWS, within=EXTRACTION),
    "CONTACT FILE": Rule(
        "step",
        "FREQUENCY=integer; SLAVE=surface; MASTER=surface; NSET=nset",
        "name...",
        rows=ANY_ROWS,
    ),
    "END STEP": Rule("step", rows=NO_ROWS),
}
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
# what gives elements properties, and types of elements by how many nodes they have
TYPES_BY_SECTION: dict[str, dict[int, str]] = {
    "SOLID SECTION": {
        2: "T3D2",
        3: "CGAX3 CGAX3H",
        4: "CGAX4 CGAX4H CGAX4R CGAX4RH C3D4 C3D4H",
        6: "CGAX6 CGAX6H C3D6 C3D6H",
        8: "CGAX8 CGAX8H CGAX8R CGAX8RH C3D8 C3D8H C3D8I C3D8IH C3D8R C3D8RH",
        10: "C3D10 C3D10H C3D10M C3D10MH",
        12: "CCL12 CCL12H",
        15: "C3D15 C3D15H",
        18: "CCL18 CCL18H",
        20: "C3D20 C3D20H C3D20R C3D20RH",
        24: "CCL24 CCL24H CCL24R CCL24RH",
    },
    "SURFACE SECTION": {
        2: "SFMGAX1",
        3: "SFMGAX2 SFM3D3",
        4: "SFM3D4 SFM3D4R",
        6: "SFM3D6 SFMCL6",
        8: "SFM3D8 SFM3D8R",
        9: "SFMCL9",
    },
    "MEMBRANE SECTION": {
        3: "M3D3",
        4: "M3D4 M3D4R",
        6: "M3D6 MCL6",
        8: "M3D8 M3D8R",
        9: "M3D9 M3D9R MCL9",
    },
    "SHELL SECTION": {3: "S3 S3R", 4: "S4 S4R", 8: "S8R"},
    "RIGID BODY": {2: "RAX2", 3: "R3D3", 4: "R3D4"},
    "MASS": {1: "MASS"},
    "ROTARY INERTIA": {1: "ROTARYI"},
    "SPRING": {1: "SPRING1"},
}
NODES_AND_SECTION: dict[str, tuple[int, str]] = {
    name: (count, section)
    for section, counts in TYPES_BY_SECTION.items()
    for count, names in counts.items()
    for name in names.split()
}
