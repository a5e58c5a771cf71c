"""Keywords of steps, and those that may stand in one, by ABAQUS' manual."""

from __future__ import annotations

from .rule import ANY_ROWS, NO_ROWS, ONE_ROW, Rule

EXTRACTION = ("FREQUENCY", "BUCKLE", "COMPLEX FREQUENCY")
STEP_PROCEDURES = (
    *("STATIC", *EXTRACTION, "DYNAMIC", "STEADY STATE TRANSPORT", "VISCO"),
    *("STEADY STATE DYNAMICS", "MODAL DYNAMIC"),
)

STEP_RULES: dict[str, Rule] = {
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
