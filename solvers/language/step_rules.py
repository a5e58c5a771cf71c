"""Keywords of steps, or that may be in one, by ABAQUS' manual; `rule` explains the notation."""

from __future__ import annotations

STEP_PROCEDURES = (
    *("STATIC", "FREQUENCY", "BUCKLE", "COMPLEX FREQUENCY", "DYNAMIC", "STEADY STATE TRANSPORT"),
    *("VISCO", "STEADY STATE DYNAMICS", "MODAL DYNAMIC"),
)

STEP_RULES = """
*RESTART (model step, output) WRITE; READ; FREQUENCY=integer; NUMBER INTERVAL=integer; OVERLAY;
    TIME MARKS=YES|NO|; STEP=integer; INC=integer; END STEP
  needs: WRITE|READ
  alone: FREQUENCY; NUMBER INTERVAL
  section: WRITE; FREQUENCY
*BOUNDARY (model step) OP=MOD|NEW; AMPLITUDE=amplitude; TYPE=DISPLACEMENT|VELOCITY|ACCELERATION;
    FIXED
  lines 1+: node freedom integer? number? as node, first, last, value=0
  step: OP
  deck step: OP; AMPLITUDE
  deck|section|revolve:
*STEP (model) NAME=name; NLGEOM=YES|NO|; INC=integer; PERTURBATION;
    EXTRAPOLATION=LINEAR|PARABOLIC|NO; UNSYMM=YES|NO; AMPLITUDE=STEP|RAMP; CONVERT SDI=YES|NO
  lines 0+: text...
  deck step: ~NAME; NLGEOM=YES|; ~INC; ~EXTRAPOLATION; ~UNSYMM; ~CONVERT SDI
  step: ~NAME; NLGEOM=YES|; ~INC; ~PERTURBATION
*STATIC (step, once a step) LONG TERM; DIRECT=|NO STOP; STABILIZE=any; RIKS; FACTOR=number;
    ALLSDTOL=number; CONTINUE=YES|NO|
  lines 0-2: 4*number? as first, period=1, least, most
  deck step|step: LONG TERM; ~DIRECT=
*FREQUENCY (step, once a step) EIGENSOLVER=LANCZOS|SUBSPACE|AMS; PROPERTY EVALUATION=number;
    NORMALIZATION=MASS|DISPLACEMENT; SIM=YES|NO|; ACOUSTIC COUPLING=ON|OFF|PROJECTION;
    RESIDUAL MODES; NUMBER INTERVAL=integer; BIAS=number
  lines 1+: integer? 6*number? as modes, lowest, highest, shift
  step: EIGENSOLVER=LANCZOS; NORMALIZATION=MASS; PROPERTY EVALUATION; SIM=NO
*COMPLEX FREQUENCY (step, once a step, after FREQUENCY) PROPERTY EVALUATION=number;
    FRICTION DAMPING=YES|NO; NORMALIZATION=DISPLACEMENT|MODAL; UNSTABLE MODES ONLY=name;
    LEFT EIGENVECTORS; RIGHT EIGENVECTORS
  lines 1: integer? 5*number? as modes
  step: PROPERTY EVALUATION
*DSLOAD (step) OP=MOD|NEW; AMPLITUDE=amplitude; FOLLOWER=YES|NO|; CONSTANT RESULTANT=YES|NO|
  lines 1+: surface name 7*number? as surface, load, pressure
  deck step: ~OP; AMPLITUDE
  step: OP=MOD
*DLOAD (step) OP=MOD|NEW; AMPLITUDE=amplitude
  lines 1+: element name 7*number?
  names: elements, load, size, x=0, y=0, z=0, along x=0, along y=0, along z=0
  deck step: ~OP; AMPLITUDE
  step: OP=MOD
*CLOAD (step) OP=MOD|NEW; AMPLITUDE=amplitude; FOLLOWER
  lines 1+: node integer number as node, freedom, force
  step: OP=MOD
  instead: delete it: only the inflation pressure acts
*CONTACT CONTROLS (step, contact) SLAVE=surface; MASTER=surface; STABILIZE=any; RESET;
    TANGENT FRACTION=number; STIFFNESS SCALE FACTOR=number
  lines 0-2: 3*number?
  step: ~SLAVE; ~MASTER; ~STABILIZE=
*FILE FORMAT (model step, once a job, output) ASCII; ZERO INCREMENT
  step: ASCII
*NODE FILE (step, output) FREQUENCY=integer; NSET=nset; GLOBAL=YES|NO|; MODE=integer;
    LAST MODE=integer
  lines 0+: name...
  step: NSET; FREQUENCY
*MODAL FILE (step, output, within FREQUENCY; BUCKLE; COMPLEX FREQUENCY) FREQUENCY=integer
  step:
*CONTACT FILE (step, output) FREQUENCY=integer; SLAVE=surface; MASTER=surface; NSET=nset
  lines 0+: name...
  step: SLAVE
*END STEP (step)
  deck step|step:
"""
