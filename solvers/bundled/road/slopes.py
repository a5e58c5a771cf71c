"""Exact derivatives of the pressed tyre by numbers of its deck, load after load.

At each load reached, the residual r(y, y0, p) of displacements and road height y is zero; y0 are
those of the load before, from where slip counts, and p is a number of the deck:

    K dy/dp = -(dr/dp + dr/dy0 dy0/dp),    K = dr/dy

from the inflated tyre on, whose dU/dp is that of vibrations (`modes.sensitivity`). The vertical
stiffness is 2 / rise, N/m, rise = e . s with K s = e, a unit of half the road's force, so that

    d rise/dp = -w . (dK/dp s),    K^T w = e

The tyre's dr and dK are complex steps. The contact has kinks, where points begin to touch or to
slide: its own are central differences along all that changes it, for which no equation is solved.
A point that begins to slide is a jump of K, which the derivative of the stiffness is without.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...language.text import COMPLEX_STEP
from ..solid3d.circumference import HalfCircle
from ..solid3d.revolved import Revolved
from .contact import Contact, FlatRoad
from .contact_newton import ContactNewton, PressedState
from .contact_tangent import Equations, Tangent
from .patch import patch
from .road_data import InflatedTangent
from .tread import tread_of

Array = np.ndarray
Values = dict[str, float]
CONTACT_STEP = 1e-8  # m, of what moves most, in a difference of the contact
NUMBER_LENGTH = 1e-3  # m, that a relative change of the road's numbers counts as


class Slopes:
    """Follows `ContactNewton` with the derivatives by numbers of the deck, by name, from its road
    and state at the inflated tyre on."""

    def __init__(
        self,
        numbers: Mapping[str, InflatedTangent],
        around: HalfCircle,
        faces: Array,
        road: FlatRoad,
    ):
        """faces (e, a): nodes of the tread's line elements."""
        self.paths = {name: _Path(own, around, faces, road) for name, own in numbers.items()}

    def wanted(self, work: ContactNewton, contact: Contact) -> list[Equations]:
        """Equations of the derivatives at a contact: of each number's dy/dp, and of w."""
        if not self.paths:
            return []
        tangent = Tangent.of(contact, work.symmetry)
        unit = Equations(tangent.transposed, 0 * work.parts, 1.0)
        return [*(path.equations(work, tangent) for path in self.paths.values()), unit]

    def follow(self, work: ContactNewton, state: PressedState) -> None:
        """Follow the paths to the state from which slip counts next, which `wanted` was asked
        for."""
        for path, (parts, rise) in zip(self.paths.values(), state.derivatives[:-1], strict=True):
            path.follow(state.contact, work.symmetry.spread(parts), rise)

    def at(self, work: ContactNewton, state: PressedState, rings: Array) -> dict[str, Any]:
        """``slopes`` of a footprint's numbers at the last state followed to, whose patch is on
        nodes at the angles ``rings``, by name, and those of the whole tyre's displacements (v,
        ring, n, 3), in the names' order; empty where none was requested."""
        if not self.paths:
            return {}
        parts, lift = state.derivatives[-1]
        unit = work.symmetry.spread(parts), lift
        rates = {name: path.rates(work, state, unit, rings) for name, path in self.paths.items()}
        moved = [work.symmetry.whole(path.U, rings) for path in self.paths.values()]
        return {"slopes": rates, "displacement_slopes": np.array(moved, np.float32)}


class _Path:
    """Derivatives by one number: of the last state, and of the road that slip counts on."""

    def __init__(self, own: InflatedTangent, around: HalfCircle, faces: Array, road: FlatRoad):
        self.tyre, self.numbers = Revolved(own.model, own.loads, around), own.road
        self.around, self.faces, X = around, faces, own.model.mesh.X
        self.X, self.dX = np.real(X), np.imag(X) / COMPLEX_STEP
        nodes = road.tread.nodes.ravel()
        crown = nodes[np.argmax(self.X[nodes, 0] + road.U[0, nodes, 0])]
        # derivatives, as U and ``elastic`` are: per unit of the number
        self.free_radius = self.height = float(self.dX[crown, 0] + own.U[crown, 0])
        self.U = np.multiply.outer(around.turn(0).real, own.U)
        self.elastic = 0 * road.elastic
        self.last = {"U": self.U, "elastic": self.elastic, "height": self.height}
        # by name of a field of the road: its derivative; the road has the state of the load before
        self.since: dict[str, Array | float] = {}

    def equations(self, work: ContactNewton, tangent: Tangent) -> Equations:
        """Equations for dy/dp at the tangent's contact, where slip counts from the state before."""
        contact = tangent.contact
        self.since, self.elastic = self.last, self.last["elastic"]
        self.U, self.height = 0 * self.U, 0.0
        step, (above, below) = self._beside(contact)
        force = self.tyre.residual(contact.U).imag / COMPLEX_STEP
        force += (above.field - below.field) / (2 * step)
        more = (above.force - below.force) / (2 * step)
        return Equations(tangent, -work.symmetry.gather(force), more / 2)

    def follow(self, contact: Contact, U: Array, height: float) -> None:
        """Follow the path to the state of a contact, by dy/dp there."""
        self.U, self.height = U, height
        step, (above, below) = self._beside(contact)
        slip = above.road.settled(above).elastic - below.road.settled(below).elastic
        self.elastic = slip / (2 * step)
        self.last = {"U": self.U, "elastic": self.elastic, "height": self.height}

    def rates(
        self, work: ContactNewton, state: PressedState, unit: tuple[Array, float], rings: Array
    ) -> Values:
        """d / dp of a footprint's numbers; unit: w on the fields (k, n, 3) and on the road's
        height, m/N."""
        W, lift = unit
        S, rise = work.symmetry.spread(state.unit[0]), state.unit[1]
        step, contacts = self._beside(state.contact)
        sizes = []  # the last: w . K s, whose derivative is that of -rise
        for sign, each in zip((1, -1), contacts, strict=True):
            half = patch(each, self.X + sign * step * self.dX, rings)
            forces = (each.matrix() @ S.ravel()).reshape(S.shape) + rise * each.by_height()
            load = (each.force_by_height() * S).sum() + rise * each.stiffness
            bent = (W * forces).sum() + lift * load
            sizes.append([2 * half.area.sum(), half.length, half.width, bent])
        area, length, width, bent = (np.array(sizes[0]) - sizes[1]) / (2 * step)
        self.tyre.residual(state.contact.U + 1j * COMPLEX_STEP * self.U)
        bent += (W * self.tyre.product(S).imag).sum() / COMPLEX_STEP
        return {
            "deflection_m": self.free_radius - self.height,
            "stiffness_N_per_m": float(state.stiffness**2 / 2 * bent),
            "contact_area_m2": float(area),
            "contact_length_m": float(length),
            "contact_width_m": float(width),
        }

    def _beside(self, contact: Contact) -> tuple[float, list[Contact]]:
        """A step of the number, and the contact so far above and below."""
        road, lengths = contact.road, [self.dX, self.U, self.height, *self.since.values()]
        lengths += [NUMBER_LENGTH * dn / getattr(road, n) for n, dn in self.numbers.items() if dn]
        step = CONTACT_STEP / max(*(float(np.abs(each).max()) for each in lengths), 1e-300)
        beside = []
        for move in (step, -step):
            rates = {**self.numbers, **self.since}
            moved = {name: getattr(road, name) + move * rate for name, rate in rates.items()}
            if self.dX.any():
                moved["tread"] = tread_of(self.X + move * self.dX, self.faces, self.around)
            there = contact.U + move * self.U, contact.height + move * self.height
            beside.append(replace(road, **moved).forces(*there))
        return step, beside
