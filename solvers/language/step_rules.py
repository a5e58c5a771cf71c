"""Keywords of steps, and those that may be in one, by ABAQUS' manual.

`rule` explains the notation: levels, parameters ("NAME=kind; OTHER=ONE|TWO"), fields of the data
lines ("4*number?"), and ``honoured`` by kind of job, where ~ marks an option that changes no
answer.
"""

from __future__ import annotations

from .rule import ANY_ROWS, ONE_ROW, KeywordRule

EXTRACTION = ("FREQUENCY", "BUCKLE", "COMPLEX FREQUENCY")
STEP_PROCEDURES = (
    *("STATIC", *EXTRACTION, "DYNAMIC", "STEADY STATE TRANSPORT", "VISCO"),
    *("STEADY STATE DYNAMICS", "MODAL DYNAMIC"),
)

STEP_RULES: dict[str, KeywordRule] = {
    "RESTART": KeywordRule(
        "model step",
        (
            "WRITE; READ; FREQUENCY=integer; NUMBER INTERVAL=integer; OVERLAY; "
            "TIME MARKS=YES|NO|; STEP=integer; INC=integer; END STEP"
        ),
        needs=("WRITE|READ",),
        alone=("FREQUENCY", "NUMBER INTERVAL"),
        honoured={"section": "WRITE; FREQUENCY"},
        is_output=True,
    ),
    "BOUNDARY": KeywordRule(
        "model step",
        "OP=MOD|NEW; AMPLITUDE=amplitude; TYPE=DISPLACEMENT|VELOCITY|ACCELERATION; FIXED",
        "node freedom integer? number?",
        honoured={"step": "OP", "deck step": "OP; AMPLITUDE", "deck|section|revolve": ""},
        data="node, first, last, value=0",
    ),
    "STEP": KeywordRule(
        "model",
        (
            "NAME=name; NLGEOM=YES|NO|; INC=integer; PERTURBATION; "
            "EXTRAPOLATION=LINEAR|PARABOLIC|NO; UNSYMM=YES|NO; AMPLITUDE=STEP|RAMP; "
            "CONVERT SDI=YES|NO"
        ),
        "text...",
        rows=ANY_ROWS,
        honoured={
            "deck step": "~NAME; NLGEOM=YES|; ~INC; ~EXTRAPOLATION; ~UNSYMM; ~CONVERT SDI",
            "step": "~NAME; NLGEOM=YES|; ~INC; ~PERTURBATION",
        },
    ),
    "STATIC": KeywordRule(
        "step",
        (
            "LONG TERM; DIRECT=|NO STOP; STABILIZE=any; RIKS; FACTOR=number; ALLSDTOL=number; "
            "CONTINUE=YES|NO|"
        ),
        "4*number?",
        rows=(0, 2),
        once="step",
        honoured={"deck step|step": "LONG TERM; ~DIRECT="},
        data="first, period=1, least, most",
    ),
    "FREQUENCY": KeywordRule(
        "step",
        (
            "EIGENSOLVER=LANCZOS|SUBSPACE|AMS; PROPERTY EVALUATION=number; "
            "NORMALIZATION=MASS|DISPLACEMENT; SIM=YES|NO|; ACOUSTIC COUPLING=ON|OFF|PROJECTION; "
            "RESIDUAL MODES; NUMBER INTERVAL=integer; BIAS=number"
        ),
        "integer? 6*number?",
        once="step",
        honoured={"step": "EIGENSOLVER=LANCZOS; NORMALIZATION=MASS; PROPERTY EVALUATION; SIM=NO"},
        data="modes, lowest, highest, shift",
    ),
    "COMPLEX FREQUENCY": KeywordRule(
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
        honoured={"step": "PROPERTY EVALUATION"},
        data="modes",
    ),
    "DSLOAD": KeywordRule(
        "step",
        "OP=MOD|NEW; AMPLITUDE=amplitude; FOLLOWER=YES|NO|; CONSTANT RESULTANT=YES|NO|",
        "surface name 7*number?",
        honoured={"deck step": "~OP; AMPLITUDE", "step": "OP=MOD"},
        data="surface, load, pressure",
    ),
    "DLOAD": KeywordRule(
        "step",
        "OP=MOD|NEW; AMPLITUDE=amplitude",
        "element name 7*number?",
        honoured={"deck step": "~OP; AMPLITUDE", "step": "OP=MOD"},
        data="elements, load, size, x=0, y=0, z=0, along x=0, along y=0, along z=0",
    ),
    "CLOAD": KeywordRule(
        "step",
        "OP=MOD|NEW; AMPLITUDE=amplitude; FOLLOWER",
        "node integer number",
        honoured={"step": "OP=MOD"},
        data="node, freedom, force",
        instead="delete it: only the inflation pressure acts",
    ),
    "CONTACT CONTROLS": KeywordRule(
        "step",
        (
            "SLAVE=surface; MASTER=surface; STABILIZE=any; RESET; TANGENT FRACTION=number; "
            "STIFFNESS SCALE FACTOR=number"
        ),
        "3*number?",
        rows=(0, 2),
        honoured={"step": "~SLAVE; ~MASTER; ~STABILIZE="},
        is_contact=True,
    ),
    "FILE FORMAT": KeywordRule(
        "model step",
        "ASCII; ZERO INCREMENT",
        once="job",
        honoured={"step": "ASCII"},
        is_output=True,
    ),
    "NODE FILE": KeywordRule(
        "step",
        "FREQUENCY=integer; NSET=nset; GLOBAL=YES|NO|; MODE=integer; LAST MODE=integer",
        "name...",
        rows=ANY_ROWS,
        honoured={"step": "NSET; FREQUENCY"},
        is_output=True,
    ),
    "MODAL FILE": KeywordRule(
        "step", "FREQUENCY=integer", within=EXTRACTION, honoured={"step": ""}, is_output=True
    ),
    "CONTACT FILE": KeywordRule(
        "step",
        "FREQUENCY=integer; SLAVE=surface; MASTER=surface; NSET=nset",
        "name...",
        rows=ANY_ROWS,
        honoured={"step": "SLAVE"},
        is_output=True,
    ),
    "END STEP": KeywordRule("step", honoured={"deck step|step": ""}),
}
