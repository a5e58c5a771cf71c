"""A tyre of the makers of study 3: a mould, compounds, cords, and what is the matter with it.

Numbers of compounds and cords are those of the case that is diagnosed, drawn by its uncertainties;
all else is the maker's own. `problem` is what `solve.py` is told.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import atan, exp, radians
from typing import Any

import numpy as np

from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.schema import Cord, Rubber

from .section import SKIM, TREAD, VOID, Mould, Section, section

Array = np.ndarray
HARMONICS, MODES, DEGREE = [0, 1, 2, 3, 4], 3, 3
OWN_LAWS = {"cord_law": "nominal", "volume_law": "ln J"}
BLOCKS = 2.0  # pattern's stiffness goes with this power of the share of rubber in it
PER_KELVIN = {"static": 0.006, "dynamic": 0.008, "textile": 0.0012}  # rubber softens, exponentially
TEXTILE_Pa = 5e10  # cords below this are textile
SEPARATED = 0.08  # share of the skim's stiffness that is left where belts have parted


@dataclass(frozen=True)
class Compound:
    """Rubber: C10 and dynamic C10, Pa, the second what relaxes in the static state; D1, 1/Pa."""

    C10: float
    dynamic: float
    D1: float
    density: float


@dataclass(frozen=True)
class Cords:
    """Cords of a ply: E A / spacing, N/m; radians from the meridian; kg/m2; textile ones soften
    with temperature; prestrain: strain from the built state at which they bear nothing; slack: they
    bear no compression."""

    stiffness: float
    angle: float
    area_density: float
    textile: bool
    prestrain: float = 0.0
    slack: bool = False


@dataclass(frozen=True)
class Tyre:
    """wires: E A of a bead, N, and their kg/m; shift_Pa: what a gauge is off at all pressures;
    nominal_Pa: pressure of the case. The rest is 0 in a sound tyre: kelvin above the case's
    temperature, drift in kelvin per 100 kPa, gauge as a share of the pressure, cap N/m more, fan:
    A/s falls as (bead radius / r)^fan, parted: m of belt edge, left_in: share more of a pressure
    below the case's, lining: kg/m2 under the belt, spindle: compliance by direction, m/N or
    rad/(N m); wheel: its mass, kg, and moments of inertia, polar and diametral, kg m2, which no
    other tyre feels."""

    mould: Mould
    columns: tuple[int, ...]
    compounds: dict[str, Compound]
    cords: dict[str, Cords]
    wires: tuple[float, float]
    nominal_Pa: float
    shift_Pa: float = 0.0
    void: float = VOID
    kelvin: float = 0.0
    drift: float = 0.0
    gauge: float = 0.0
    cap: float = 0.0
    fan: float = 0.0
    parted: float = 0.0
    left_in: float = 0.0
    lining: float = 0.0
    spindle: Mapping[str, float] = field(default_factory=dict)
    wheel: tuple[float, float, float] = (15.0, 0.43, 0.27)


def tyre_of(case: LoadedCase, mould: Mould, columns: list[int]) -> Tyre:
    """With the numbers of a case as `tyrecal init` writes it."""
    c, omega = case.case, 2 * np.pi * (case.case.analysis.vibration_frequency_Hz or 0.0)
    compounds, cords = {}, {}
    for name, m in c.materials.items():
        if isinstance(m, Rubber):
            back = 0.0  # of G, in the vibration
            for term in m.prony:
                square = (omega * term.tau_s) ** 2
                back += term.g / (1 - sum(t.g for t in m.prony)) * square / (1 + square)
            compounds[name] = Compound(m.C10_Pa, back * m.C10_Pa, m.D1_per_Pa, m.density_kg_per_m3)
    wires = (0.0, 0.0)
    for name, layer in c.rebar_layers.items():
        cord = c.materials[layer.material]
        assert isinstance(cord, Cord) and layer.spacing_m
        per_m = layer.area_m2 / layer.spacing_m
        E, density = cord.youngs_modulus_Pa, cord.density_kg_per_m3
        if name == "bead_wire":  # of the case's bead, about as long as ours
            length = float(np.hypot(*np.subtract(mould.rim, mould.seat)))
            wires = E * per_m * length, density * per_m * length
        else:
            cords[name] = Cords(
                E * per_m,
                radians(layer.angle_deg),
                density * per_m,
                TEXTILE_Pa > E,
                slack=not cord.bears_compression,
            )
    shift = 1e3 * (c.pressure_kPa - case.file_data["pressure_kPa"])
    rim = c.rim
    return Tyre(
        mould,
        tuple(columns),
        compounds,
        cords,
        wires,
        1e3 * case.file_data["pressure_kPa"],
        shift,
        wheel=(rim.mass_kg, rim.polar_inertia_kg_m2, rim.diametral_inertia_kg_m2),
    )


def problem(tyre: Tyre, pressures_kPa: list[float], each: int = 1) -> dict[str, Any]:
    """Mesh and constants at stated pressures. each: elements for one of the columns."""
    counts = [each * n for n in tyre.columns]
    made = section(tyre.mould, counts)
    mesh = Mesh.of(made)
    states = [_state(tyre, mesh, 1e3 * p) for p in pressures_kPa]
    return {**mesh.told(made.marks["held"]), **OWN_LAWS, "states": states} | {
        "harmonics": HARMONICS,
        "modes": MODES,
        "degree": DEGREE,
        "wheel": on_springs(tyre),
    }


def on_springs(tyre: Tyre) -> dict[str, list[float]]:
    """Stiffness and inertia of a wheel by the direction in which it gives way."""
    mass, polar, diametral = tyre.wheel
    inertia = {"lateral": mass, "torsional": polar, "radial": mass, "tilt": diametral}
    return {way: [1 / soft, inertia[way]] for way, soft in tyre.spindle.items() if soft}


@dataclass(frozen=True)
class Mesh:
    """Triangles of six nodes, two to a cell of the grid; cells (2, rows, columns): those on the
    inner and those on the outer side of a diagonal, each with a line for its own."""

    section: Section
    nodes: Array  # (k, 2)
    number: Array  # (layers, columns) of nodes
    middle: Array  # s (columns,) of elements

    @classmethod
    def of(cls, made: Section) -> Mesh:
        lines = made.points
        layers = [lines[0]]
        for below, above in pairwise(lines):
            layers += [(below + above) / 2, above]
        number = np.arange(len(layers) * lines.shape[1]).reshape(len(layers), -1)
        return cls(made, np.array(layers).reshape(-1, 2), number, made.s[1::2])

    @property
    def rows(self) -> int:
        return len(self.section.points) - 1

    def cells(self) -> Array:
        """(2 rows columns, 6): first those with a side on the line above them, then those with a
        side on the line below."""
        high, wide = self.number.shape
        at = lambda i, j: self.number[i : high - 2 + i : 2, j : wide - 2 + j : 2].ravel()
        a, b, c, d, ac = at(0, 0), at(2, 0), at(2, 2), at(0, 2), at(1, 1)
        # after its corners a triangle has the middles of the sides that they face
        upper = np.stack([a, b, c, at(2, 1), ac, at(1, 0)], 1)
        lower = np.stack([a, c, d, at(1, 2), at(0, 1), ac], 1)
        return np.concatenate([upper, lower])

    def told(self, rim: float) -> dict[str, Any]:
        """Connectivity. The rim holds the bead's outside beyond s = ``rim``, and its end."""
        n, s = self.number, self.middle
        wide, high = n.shape[1], n.shape[0]
        edge = lambda row: [(int(n[row, j]), int(n[row, j + 2])) for j in range(0, wide - 1, 2)]
        across = lambda j: [(int(n[i, j]), int(n[i + 2, j])) for i in range(0, high - 1, 2)]
        outside = [pair for pair, at in zip(edge(-1), s, strict=True) if at > rim]
        return {
            "cells": self.cells().tolist(),
            "nodes": self.nodes.tolist(),
            "lines": [pair for row in range(2, high - 1, 2) for pair in edge(row)],
            "inner": edge(0),
            "held": outside + across(wide - 1),
            "crown": across(0),
        }

    def areas(self) -> Array:
        """(rows, columns) of the cells, m2, as quadrangles."""
        p = self.section.points[:, ::2]
        one, two = p[1:, 1:] - p[:-1, :-1], p[1:, :-1] - p[:-1, 1:]
        return np.asarray(abs(one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]) / 2)


def _state(tyre: Tyre, mesh: Mesh, nominal: float) -> dict[str, Any]:
    """Constants of every cell, and of the line above it, at a pressure that a gauge shows."""
    m, marks, s = tyre.mould, mesh.section.marks, mesh.middle
    below = nominal < tyre.nominal_Pa
    pressure = (nominal + tyre.shift_Pa) * (1 + tyre.gauge + below * tyre.left_in)
    # a run of pressures warms the tyre, less and less
    kelvin = tyre.kelvin + 1.25 * tyre.drift * atan((nominal - tyre.nominal_Pa) / 1e5 / 1.25)
    names = material_names(mesh, tyre)
    shape = names.shape
    static = exp(-PER_KELVIN["static"] * kelvin)
    dynamic = exp(-PER_KELVIN["dynamic"] * kelvin)
    of = lambda key: np.array([[getattr(tyre.compounds[x], key) for x in row] for row in names])
    C10, viscous = static * of("C10"), dynamic * of("dynamic")
    D1, density, hoop = of("D1") / static, of("density"), np.zeros(shape)
    pattern = (slice(shape[0] - 1, None), s < TREAD * marks["belt"])
    solid = 1 - tyre.void
    C10[pattern] *= solid**BLOCKS
    viscous[pattern] *= solid**BLOCKS
    D1[pattern] /= solid**BLOCKS
    density[pattern] *= solid
    if tyre.parted:  # of an element at the end of what has parted, its share
        pair = _widest_two(m)
        rows = slice(*(m.lines.index(f"belt_{k}") for k in pair))
        edge, ends = min(m.belts[k - 1] for k in pair), mesh.section.s[::2]
        over = np.clip(ends[1:], None, edge) - np.clip(ends[:-1], edge - tyre.parted, None)
        left = 1 - (1 - SEPARATED) * np.clip(over / np.diff(ends), 0, 1)
        C10[rows] *= left
        viscous[rows] *= left
    core = s > marks["rim"]
    area = mesh.areas()[1][core].sum()
    hoop[1, core] = tyre.wires[0] / area
    density[1, core] += tyre.wires[1] / area
    lining = np.zeros(shape)
    lining[0, s < marks["belt"]] = tyre.lining
    both = lambda values: np.concatenate([values.ravel()] * 2).tolist()
    return {
        "pressure": pressure,
        "C10": both(C10),
        "C01": 0.0,
        "D1": both(D1),
        "density": both(density),
        "dynamic_C10": both(viscous),
        "hoop_Pa": both(hoop),
        "lining": both(lining),
        **_on_lines(tyre, mesh, kelvin),
    }


def _on_lines(tyre: Tyre, mesh: Mesh, kelvin: float) -> dict[str, list[float]]:
    """Cords on the line above each cell; none on those of the other triangles."""
    m, marks, s = tyre.mould, mesh.section.marks, mesh.middle
    table = {
        key: np.zeros((mesh.rows, len(s)))
        for key in ("stiffness", "angle", "area_density", "prestrain", "slack")
    }
    radius = mesh.section.points[1, 1::2, 0]
    fan = (m.rim[0] / radius) ** tyre.fan
    for name, cords in tyre.cords.items():
        line = {"carcass": "ply", "carcass_turn_up": "belt_1", "cap_ply": "cap"}.get(name, name)
        row = m.lines.index(line) - 1  # below the line
        there = {
            "carcass": s > -1,
            "carcass_turn_up": s > marks["turn_up"],
            "cap_ply": s < m.cap,
        }.get(name)
        if there is None:
            there = s < m.belts[int(name.split("_")[1]) - 1]
        share = fan[there] if name.startswith("carcass") else 1.0
        softer = exp(-PER_KELVIN["textile"] * kelvin) if cords.textile else 1.0
        table["stiffness"][row, there] = cords.stiffness * share * softer
        table["angle"][row, there] = cords.angle
        table["area_density"][row, there] = cords.area_density * share
        table["prestrain"][row, there] = cords.prestrain
        table["slack"][row, there] = cords.slack
    if tyre.cap:
        row, there = m.lines.index("cap") - 1, s < m.cap
        table["stiffness"][row, there] += tyre.cap * np.where(s > 0.8 * m.cap, 1.3, 1.0)[there]
        table["angle"][row, there] = np.pi / 2
        table["area_density"][row, there] += 1e-6 + tyre.cap * 1150.0 / 4e9  # of aramid and nylon
    return {key: [*values.ravel().tolist(), *[0.0] * values.size] for key, values in table.items()}


def _widest_two(m: Mould) -> tuple[int, int]:
    """Belts (from 1) next to one another with the widest common edge."""
    pairs = [(k, k + 1) for k in range(1, len(m.belts))]
    return max(pairs, key=lambda pair: min(m.belts[k - 1] for k in pair))


def material_names(mesh: Mesh, tyre: Tyre) -> Array:
    """Compound of each cell, (rows, columns)."""
    m, marks, s = tyre.mould, mesh.section.marks, mesh.middle
    names = np.full((mesh.rows, len(s)), "sidewall", dtype=object)
    names[0] = "inner_liner"
    belted, filled = s < SKIM * marks["belt"], s > marks["filler"]
    cap, base = m.lines.index("cap"), m.lines.index("base")
    names[1:cap, belted] = "belt_skim"
    names[cap:base, belted] = "under_tread"
    names[base:, s < TREAD * marks["belt"]] = "tread"
    names[1, filled] = "bead_filler"
    strip = s > (marks["filler"] + marks["rim"]) / 2
    names[2:, strip] = "rim_strip"
    return names


def tempered(tyre: Tyre, name: str, factor: float) -> Tyre:
    """One compound's shear and bulk modulus times a factor."""
    m = tyre.compounds[name]
    stiff = replace(m, C10=m.C10 * factor, dynamic=m.dynamic * factor, D1=m.D1 / factor)
    return replace(tyre, compounds={**tyre.compounds, name: stiff})
