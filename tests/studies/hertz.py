"""A stand-in that presses tyres by a formula: an elliptic patch of Hertz's pressure.

At 4 kN the patch has half axes of 80 mm along and 50 mm across and the axle comes 20 mm down; half
axes grow with the cube root of the load, the deflection with its square, and the area falls with
A_belt (its start: 2.118683e-7 m2). Loads beyond ``reach`` are not reached.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
from tyrecal_solvers.bundled.adapter import Bundled

from ..conftest import CASES

BELT = 2.118683e-7
FREE = 0.3925
ANGLES = np.radians([*np.arange(0, 30, 1.5), *np.arange(30, 331, 15), *np.arange(331.5, 360, 1.5)])


def coarse_case(folder: Path) -> Path:
    """The main case on a mesh that the bundled solver presses in seconds."""
    text = (CASES / "p235_75r17.yaml").read_text()
    for old, new in (
        (
            "{crown: 8, upper_sidewall: 8, lower_sidewall: 8, bead: 2}",
            "{crown: 4, upper_sidewall: 3, lower_sidewall: 3, bead: 1}",
        ),
        ("rows: [1, 1, 1, 3] ", "rows: [1, 1, 1, 1] "),
        ("grading: [1.0, 1.0, 1.0, 0.7]", "grading: [1.0, 1.0, 1.0, 1.0]"),
        ("\nvariables:", "\nroad: {element_angles_deg: [6, 6, 6, 12, 30, 120]}\n\nvariables:"),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    shutil.copy(CASES / "p235_75r17.csv", folder)
    path = folder / "coarse.yaml"
    path.write_text(text)
    return path


class NotReached(RuntimeError):
    """Error: not even the first load is reached."""

    cause = "no_equilibrium"


class Hertz(Bundled):
    """The bundled solver for modes; footprints by the formula."""

    capabilities = Bundled.capabilities - {"footprint_gradients"}
    failures = (*Bundled.failures, NotReached)
    reach = 20e3

    def write(self, decks: Any, folder: Path) -> list[Path]:
        """The real decks; remembers what the formula needs."""
        if not decks.loads_N:
            return super().write(decks, folder)
        self.mesh, self.loads = decks.design.tyre.mesh, decks.loads_N
        self.size = (BELT / decks.design.tyre.case.rebar_layers["belt_1"].area_m2) ** 0.05
        self.pressure = decks.design.tyre.case.pressure_kPa * 1e3
        paths = []
        for name, text in decks.texts(self.dialect).items():
            paths.append(folder / name)
            paths[-1].write_text(text)
        return paths

    def run(self, folder: Path, time_limit_s: float) -> None:
        """Fail where the first load is out of reach."""
        if not (folder / "press.inp").exists():
            super().run(folder, time_limit_s)
        elif self.loads[0] > self.reach:
            raise NotReached(f"the rim is on the road at {self.reach:g} N")

    def read(self, folder: Path) -> dict[str, Any]:
        """The contract's plain data."""
        if not (folder / "press.inp").exists():
            return super().read(folder)
        mesh = self.mesh
        within = [load for load in self.loads if load <= self.reach]
        short = len(within) < len(self.loads)
        return {
            "pressure_Pa": self.pressure,
            "mass_kg": 12.8,
            "nodes": np.array(list(mesh.nodes)),
            "points": np.array(list(mesh.nodes.values())),
            "angles": ANGLES,
            "free_radius_m": FREE,
            "failure": f"the rim is on the road at {self.reach:g} N" if short else "",
            "footprints": [self.footprint(load) for load in within],
        }

    def footprint(self, load: float) -> dict[str, Any]:
        """Footprint of one load."""
        scale = (load / 4e3) ** (1 / 3)
        a, b, deflection = 0.08 * scale * self.size, 0.05 * scale * self.size, 0.02 * scale**2
        nodes = np.array(list(self.mesh.nodes))
        R, Z = np.array(list(self.mesh.nodes.values())).T
        down = np.minimum(0.0, FREE - deflection - np.cos(ANGLES)[:, None] * R)
        down[:, R < 0.3] = 0.0
        down[np.cos(ANGLES) < 0.5] = 0.0
        u = np.stack(
            [down * np.cos(ANGLES)[:, None], -down * np.sin(ANGLES)[:, None], 0 * down], -1
        )
        outer = np.searchsorted(nodes, self.mesh.outer_nodes)
        x, y = (
            np.sin(ANGLES)[:, None] * R[outer],
            np.broadcast_to(Z[outer], (len(ANGLES), len(outer))),
        )
        inside = 1 - (x / a) ** 2 - (y / b) ** 2
        near = (np.cos(ANGLES)[:, None] > 0.8) & (R[outer] > 0.36)
        ring, column = np.nonzero(near & (inside > 0))
        along, across = x[ring, column], y[ring, column]
        pressure = np.sqrt(inside[ring, column])
        area = np.full(len(ring), np.pi * a * b / len(ring))
        pressure *= load / (pressure @ area)
        return {
            "load_N": load,
            "road_N": float(pressure @ area),
            "rim_N": np.array([load, 0.0, 0.0]),
            "deflection_m": deflection,
            "stiffness_N_per_m": 1.5 * load / deflection,
            "ring": ring,
            "node": nodes[outer][column],
            "along_m": along,
            "across_m": across,
            "pressure_Pa": pressure,
            "area_m2": area,
            "traction_Pa": np.zeros((len(ring), 2)),
            "displacement": u,
        }


def coarser_case(folder: Path) -> Path:
    """A case whose loaded modes take seconds: few elements, harmonics up to 2, and no target beyond
    them."""
    path = coarse_case(folder)
    lines = path.read_text().splitlines()
    kept = [line for line in lines if not line.startswith(("    - {c: 3", "    - {c: 4"))]
    text = "\n".join(kept) + "\n"
    for old, new in (
        ("highest_harmonic: 4", "highest_harmonic: 2"),
        (
            "{crown: 4, upper_sidewall: 3, lower_sidewall: 3, bead: 1}",
            "{crown: 3, upper_sidewall: 2, lower_sidewall: 2, bead: 1}",
        ),
        ("[6, 6, 6, 12, 30, 120]", "[6, 6, 8, 160]"),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    path.write_text(text)
    return path
