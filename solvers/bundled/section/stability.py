"""Whether an inflated tyre is stable: one judgement for modes, sensitivities and the road.

A tyre is stable if its static tangent stiffness without waves round the circumference, K(0), is
positive definite. Everything that needs an inflated tyre calls `stable_factor` first, so that no
command computes a tyre that another one refuses. The usual cause is compressed cords: in the
model they have no bending stiffness, and buckle in short waves along the section. `modes` judges
K(n) at the modulus of the vibration as well.

A tyre that turns is judged in the frame that turns with it, with K(0) - Omega^2 M in the wheel's
plane. Gyroscopic forces could hold an indefinite one without damping, but not with the damping of
rubber, which turns along (theorem of Kelvin, Tait and Chetaev). So the criterion is the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import sqrt

import numpy as np

from ...errors import Indefinite, RunFailed
from . import mechanics
from .band import Numbering
from .inflation import buckled_cords, equilibrium
from .kept_fields import Coordinates, Factor
from .loads import Spin
from .model import Model
from .parts.part import TyrePart

Array = np.ndarray
SPEED_TOL = 0.005  # of the stated speed, to which the highest stable one is bisected


def stable_factor(
    model: Model, U: Array, loads: Sequence[TyrePart], equations: Coordinates
) -> Factor:
    """Factor of the static tangent stiffness K(0) at the inflated state U (n, 3).

    ``equations``: of all vibrations without waves round the circumference, not only those of the
    state's own symmetry. Raises RunFailed (``unstable``).
    """
    stiffness = mechanics.tangents(model, U, loads, harmonics=False)[0]
    try:
        return equations.factor(equations.assemble(stiffness))
    except Indefinite:
        raise unstable(model, U) from None


def unstable(model: Model, U: Array, n: int = 0) -> RunFailed:
    """The failure of an inflated tyre with an indefinite K(n), with the cords that may cause it."""
    words = (
        f"the inflated tyre is not stable: its stiffness for {n} waves round the circumference is"
        " not positive definite"
    )
    cords = buckled_cords(model, U)
    return RunFailed("unstable", f"{words}; {cords}" if cords else words)


def slower(
    failure: RunFailed,
    model: Model,
    U: Array,
    loads: Sequence[TyrePart],
    state: Numbering,
    vibrations: Coordinates,
    check: Callable[[], None],
) -> RunFailed:
    """The failure of a tyre that turns, with the highest speed at which it is stable.

    U (n, 3): a state to start from, on the nodes of both halves; ``state``, ``vibrations``:
    equations of the inflated state and of its vibrations. Raises other failures that it meets, and
    what ``check`` raises to stop.
    """
    spins = [load for load in loads if isinstance(load, Spin)]
    if not spins or failure.cause not in ("unstable", "no_equilibrium"):
        return failure
    full, low, high = sqrt(float(np.real(spins[0].spin2))), 0.0, 1.0
    while high - low > SPEED_TOL:
        check()
        share = (low + high) / 2
        acting = [
            replace(load, spin2=share**2 * load.spin2) if isinstance(load, Spin) else load
            for load in loads
        ]
        try:
            slow, _ = equilibrium(model, state, acting, U, check)
            whole = model.mesh.symmetry.field(slow)  # on the nodes of both halves
            stable_factor(model, whole, acting, vibrations)
            low = share
        except RunFailed as slower_failure:
            if slower_failure.cause not in ("unstable", "no_equilibrium"):
                raise
            high = share
    words = f"it is stable up to {low * full:.4g} rad/s" if low else "it is unstable at any speed"
    return RunFailed(failure.cause, f"at {full:.4g} rad/s {failure}; {words}")
