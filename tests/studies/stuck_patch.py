"""Modes of a tyre whose small patch sticks to the road, by receptances: none of the road's code.

The unloaded inflated tyre gives way to forces f on a square of its tread by its harmonics n,

    u = sum over n of sinc^2(n b / 2) Re[G_n(omega) exp(i n (theta - theta'))] f / (pi, 2 pi for 0),
    G_n = Phi^H (K(n) - omega^2 M)^-1 Phi,

forces spread over strips of the angle b. The square sticks: u + H f = 0. H = 0 and harmonics up to
``HIGHEST`` leave out how the shorter ones give way: too stiff. H of the patch as a punch on a half
space (Mindlin: 4 G a / (1 - nu) down, 8 G a / (2 - nu) along), all of it although a part is in the
harmonics: too soft. Sides are those of the load at 1.13 times the pressure, and 20 % more or less.
So frequencies have bounds of their own: of the softest and the stiffest of these patches.

By Wittrick and Williams' count, which misses none: below omega the stuck tyre has as many modes as
the free one less the negative eigenvalues of u + H f. Each is told by the free mode that it moves
most, by energy. The load's deflection is left out.

    python -m tests.studies.stuck_patch
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tyrecal_solvers.bundled import job
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.road import footprint_job
from tyrecal_solvers.errors import RunFailed

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.load import load_case

Array = np.ndarray
CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
HIGHEST = 90  # harmonic: K(n) is positive up to about 100
WITH_MODES = 12  # harmonics beyond it follow quasi-statically
STRIPS = 3  # of the patch along the road
PRESSURE_RATIO = 1.13  # of the mean contact pressure over the inflation's
MIN_MODE_HZ = 30.0  # below all modes
POISSON, SHEAR_PA = 0.475, 2e6  # of the half space: the tread's rubber
# harmonic, place among its modes, and whether it is the member symmetric about the patch
LABELS = {"[1,1]": (1, 0, True), "torsion": (0, 1, False), "[2,1]": (2, 0, True)}
MIRROR = np.array([1.0, -1.0, 1.0])  # theta -> -theta


@dataclass
class Compliance:
    """G_n of one harmonic at nodes of the tread: static, of inertia, and its lowest modes."""

    static: Array  # (d, d)
    inertia: Array  # (d, d)
    eigenvalues: Array  # (m,)
    at: Array  # (d, m)

    def of(self, value: float) -> Array:
        """G at omega^2."""
        left = value**2 / (self.eigenvalues**2 * (self.eigenvalues - value))
        modes = (self.at * left) @ self.at.conj().T
        return np.asarray(self.static + value * self.inertia + modes)


def vibration_of(case: Any) -> tuple[Vibration, Array]:
    """The whole section's vibrations about its inflated state, and rows of its tread's nodes."""
    got: list[Any] = []

    def press(*given: Any) -> dict[str, Any]:
        got.extend(given)
        raise RunFailed("crashed", "not wanted")

    texts = Decks(TyreDesign(case), loads_N=(1000.0,), loaded_modes=2).texts("abaqus")
    real, footprint_job.press = footprint_job.press, press
    try:
        with tempfile.TemporaryDirectory() as name:
            for file, text in texts.items():
                (Path(name) / file).write_text(text)
            job.run(Path(name), "press", "inflate")
    except RunFailed:
        pass
    finally:
        footprint_job.press = real
    inflated, road, requests, *_ = got
    vibrating = requests[1000.0].modes
    there = inflated.U, inflated.loads, inflated.equations
    vibration = Vibration(vibrating.model, *there, 0.0)
    return vibration, np.unique(vibrating.model.mesh.faces[road.tread].connectivity)


def compliances(vibration: Vibration, rows: Array) -> list[Compliance]:
    """Compliances of all harmonics, at nodes with all three components."""
    force = np.zeros((*vibration.numbering.free.shape, 3 * len(rows)))
    force[np.repeat(rows, 3), np.tile(range(3), len(rows)), range(3 * len(rows))] = 1.0
    Phi, result = vibration.numbering.gather(force), []
    for n in range(HIGHEST + 1):
        factor = vibration.factor(n)
        x = factor.solve(Phi if n else Phi.astype(float))
        values, at = np.zeros(0), np.zeros((3 * len(rows), 0))
        if n <= WITH_MODES:
            modes = vibration.modes(n, 6, factor)
            values, at = modes.eigenvalues, modes.shapes[:, rows].reshape(6, -1).T
        result.append(Compliance(Phi.T @ x, x.conj().T @ vibration.times_mass(x), values, at))
    return result


class Patch:
    """A square of side L (m) on the tread, round its middle."""

    def __init__(self, vibration: Vibration, by_n: list[Compliance], X: Array, side: float):
        """X (nodes, 2): R and Z of the nodes that ``by_n`` is of."""
        inside = np.flatnonzero(abs(X[:, 1]) <= side / 2 + 1e-9)
        self.dofs = np.ravel(3 * inside[:, None] + np.arange(3))
        self.by_n, self.side = by_n, side
        self.strip = side / STRIPS / X[:, 0].max()
        self.places = self.strip * (np.arange(STRIPS) - (STRIPS - 1) / 2)

    def matrix(self, value: float) -> Array:
        """Compliance of u by f at omega^2, over strips and components."""
        away = self.places[:, None] - self.places
        size = len(self.dofs)
        total = np.zeros((STRIPS, size, STRIPS, size))
        for n, each in enumerate(self.by_n):
            G = each.of(value)[np.ix_(self.dofs, self.dofs)]
            share = np.sinc(n * self.strip / (2 * np.pi)) ** 2 / (np.pi if n else 2 * np.pi)
            turned = np.exp(1j * n * away)[:, None, :, None] * G[None, :, None, :]
            total += share * turned.real
        whole = total.reshape(STRIPS * size, -1)
        return (whole + whole.T) / 2

    def half_space(self) -> Array:
        """H: the punch's compliance, shared by all forces."""
        a = self.side / np.sqrt(np.pi)
        stiffness = 4 * SHEAR_PA * a / (1 - POISSON), 8 * SHEAR_PA * a / (2 - POISSON)
        down, along = (len(self.dofs) / 3 * STRIPS / k for k in stiffness)
        return np.diag(np.tile([down, along, along], STRIPS * len(self.dofs) // 3))

    def modes(self, soft: bool, up_to_Hz: float) -> list[tuple[float, dict[str, float]]]:
        """Frequencies, Hz, and the share of energy that each holds of the modes of `LABELS`."""
        H = self.half_space() if soft else 0.0
        free = np.sort(
            np.concatenate(
                [np.repeat(c.eigenvalues, 2 if n else 1) for n, c in enumerate(self.by_n)]
            )
        )

        def count(hertz: float) -> int:
            value = (2 * np.pi * hertz) ** 2
            negative = int((np.linalg.eigvalsh(self.matrix(value) + H) < 0).sum())
            return int((free < value).sum()) - negative

        roots = []
        spans = [(MIN_MODE_HZ, count(MIN_MODE_HZ), up_to_Hz, count(up_to_Hz))]
        while spans:
            a, before, b, after = spans.pop()
            if before == after:
                continue
            if b - a < 0.02:
                roots.append((a + b) / 2)
                continue
            middle = (a + b) / 2
            there = count(middle)
            spans += [(a, before, middle, there), (middle, there, b, after)]
        return sorted((hertz, self.shares(hertz, H)) for hertz in roots)

    def shares(self, hertz: float, H: Array | float) -> dict[str, float]:
        """Shares of the modes of `LABELS` in the stuck tyre's mode, by the forces that hold it,
        times how far it has their symmetry."""
        value = (2 * np.pi * hertz) ** 2
        values, vectors = np.linalg.eigh(self.matrix(value) + H)
        f = vectors[:, np.argmin(abs(values))].reshape(STRIPS, -1)
        energy: dict[tuple[int, int], float] = {}
        all_of_it = 0.0
        for n, each in enumerate(self.by_n[: WITH_MODES + 1]):
            share = np.sinc(n * self.strip / (2 * np.pi)) / np.sqrt(np.pi if n else 2 * np.pi)
            push = share * np.exp(-1j * n * self.places) @ f
            q = abs(each.at[self.dofs].conj().T @ push) ** 2 / (each.eigenvalues - value) ** 2
            energy |= {(n, k): float(size) for k, size in enumerate(q)}
            all_of_it += float(q.sum())
        # the forces' part that is even about the patch
        forces = f.reshape(STRIPS, -1, 3)
        even = float((((forces + MIRROR * forces[::-1]) / 2) ** 2).sum() / (forces**2).sum())
        return {
            label: energy[n, k] / all_of_it * (even if symmetric else 1 - even)
            for label, (n, k, symmetric) in LABELS.items()
        }


def table(loads_N: list[float], case: Any = None) -> dict[float, dict[str, list[float]]]:
    """Load to label to the free frequency, the lower and the upper bound, Hz."""
    case = case or load_case(CASE)
    vibration, rows = vibration_of(case)
    X = vibration._X[rows]
    pressure = case.case.pressure_kPa * 1e3 * PRESSURE_RATIO
    wide = 1.2 * np.sqrt(max(loads_N) / pressure)
    near = abs(X[:, 1]) <= wide / 2 + 1e-9
    rows, X = rows[near], X[near]
    by_n = compliances(vibration, rows)
    result = {}
    for load in loads_N:
        side = np.sqrt(load / pressure)
        each = {}
        for label, (n, k, _) in LABELS.items():
            each[label] = [float(np.sqrt(by_n[n].eigenvalues[k]) / (2 * np.pi))]
        for scale, soft in ((0.8, True), (1.2, False)):
            modes = Patch(vibration, by_n, X, scale * side).modes(soft, 105.0)
            for label, (free, *_) in each.items():
                most = max((m for m in modes if m[0] > free * 1.001), key=lambda m: m[1][label])
                each[label].append(most[0])
        result[load] = each
    return result


if __name__ == "__main__":
    wanted = [float(x) for x in sys.argv[1:]] or [100.0, 300.0, 1000.0]
    for load, rows in table(wanted).items():
        for label, (free, lower, upper) in rows.items():
            bounds = f"{lower - free:+6.2f} to {upper - free:+6.2f} Hz"
            print(f"{load:6g} N {label:8} free {free:7.2f}  {bounds}")
