"""From keyword blocks to the section's arrays: mesh, rubber, cords, masses, pressure, rim."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

import numpy as np

from . import section as geometry
from . import shapes
from .band import Numbering
from .keywords import DeckError, Keyword, Row
from .materials import Material, read_materials
from .rubber import MooneyRivlin

Array = np.ndarray
POINTS = {"CGAX8R": 2, "CGAX8": 3, "CGAX4R": 1}
NODES = {"CGAX8R": 8, "CGAX8": 8, "CGAX4R": 4, "SFMGAX2": 3, "SFMGAX1": 2}


@dataclass
class Mesh:
    """Nodes, elements, sets and operators: all that the materials do not touch.

    X (n, 2) in m; ``index``: node number to row; ``blocks``: element type to operators;
    ``place``: element number to (type, row of its block); ``faces``: surface name to lines.
    """

    X: Array
    index: dict[int, int]
    blocks: dict[str, geometry.Solids | geometry.Lines]
    place: dict[int, tuple[str, int]]
    node_sets: dict[str, list[int]]
    element_sets: dict[str, list[int]]
    faces: dict[str, geometry.Lines]
    reference_nodes: dict[int, list[int]]
    numberings: dict[bytes, Numbering] = field(default_factory=dict)


@dataclass
class Rubber:
    """One block of solids with constants per Gauss point (e * g,) and density per element."""

    solids: geometry.Solids
    material: MooneyRivlin
    density: Array
    hourglass_stiffness: Array


@dataclass
class Cords:
    """All rebar layers of one element type: stiffness E A / s (N/m), mass A rho / s (kg/m2)."""

    lines: geometry.Lines
    direction: Array
    b0: Array
    hoop: Array
    stiffness: Array
    mass: Array


@dataclass
class Model:
    """The tyre's section, ready for mechanics."""

    mesh: Mesh
    rubbers: list[Rubber]
    cords: list[Cords]


_MESHES: OrderedDict[tuple[object, ...], Mesh] = OrderedDict()
_TOPOLOGY = {"NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "RIGID BODY"}


def build(keywords: list[Keyword], dynamic_Hz: float | None, long_term: bool) -> Model:
    """The model of a section job.

    ``dynamic_Hz``: evaluate the rubber's vibration modulus at this frequency, None = static;
    ``long_term``: the static state is relaxed (else instantaneous moduli).
    Raises DeckError. The mesh is remembered while its blocks stay the same.
    """
    topology = [k for k in keywords if k.name in _TOPOLOGY]
    if any(k.tangents for k in topology):
        mesh = _mesh(topology)
    else:
        key = tuple(k.identity for k in topology)
        known = _MESHES.get(key)
        mesh = known if known is not None else _mesh(topology)
        _MESHES[key] = mesh
        _MESHES.move_to_end(key)
        while len(_MESHES) > 8:
            _MESHES.popitem(last=False)
    return _properties(keywords, mesh, dynamic_Hz, long_term)


def _mesh(keywords: list[Keyword]) -> Mesh:
    index: dict[int, int] = {}
    coordinates: list[tuple[complex | float, complex | float]] = []
    node_sets: dict[str, list[int]] = {}
    element_sets: dict[str, list[int]] = {}
    connectivity: dict[str, list[list[int]]] = {}
    place: dict[int, tuple[str, int]] = {}
    for k in keywords:
        if k.name == "NODE":
            numbers = []
            for row in k.rows:
                number = row.integer(0)
                if number in index:
                    raise DeckError(row.line, f"node {number} is defined twice")
                index[number] = len(coordinates)
                coordinates.append((row.number(1), row.number(2, 0.0)))
                numbers.append(number)
            if k.get("NSET"):
                node_sets.setdefault(k.get("NSET"), []).extend(numbers)
        elif k.name == "ELEMENT":
            _elements(k, index, connectivity, place, element_sets)
        elif k.name == "NSET":
            node_sets.setdefault(k.need("NSET"), []).extend(_members(k, node_sets, index))
        elif k.name == "ELSET":
            element_sets.setdefault(k.need("ELSET"), []).extend(_members(k, element_sets, place))
    X = np.array(coordinates)
    blocks: dict[str, geometry.Solids | geometry.Lines] = {}
    for kind, rows in connectivity.items():
        table = np.array(rows)
        if kind in POINTS:
            try:
                blocks[kind] = geometry.solids(X, table, POINTS[kind])
            except geometry.FoldedElement as error:
                number = next(e for e, p in place.items() if p == (kind, error.index))
                raise DeckError(
                    0,
                    f"element {number} has no positive area: it folds over"
                    " or its nodes run clockwise",
                ) from None
        else:
            blocks[kind] = geometry.lines(X, table)
    faces = {
        k.need("NAME"): _surface(k, X, connectivity, place, element_sets)
        for k in keywords
        if k.name == "SURFACE"
    }
    bodies = {}
    for k in keywords:
        if k.name == "RIGID BODY":
            reference, tied = int(k.number("REF NODE") or 0), k.need("TIE NSET")
            if reference not in index or tied not in node_sets:
                raise DeckError(k.line, f"node {reference} or node set {tied} is not defined")
            bodies[reference] = node_sets[tied]
    return Mesh(X, index, blocks, place, node_sets, element_sets, faces, bodies)


def _elements(
    k: Keyword,
    index: dict[int, int],
    connectivity: dict[str, list[list[int]]],
    place: dict[int, tuple[str, int]],
    sets: dict[str, list[int]],
) -> None:
    kind = k.need("TYPE")
    table = connectivity.setdefault(kind, [])
    for row in k.rows:
        number, nodes = row.integer(0), [row.integer(i + 1) for i in range(NODES[kind])]
        if len(row.fields) != NODES[kind] + 1:
            raise DeckError(row.line, f"a {kind} element has {NODES[kind]} nodes")
        if number in place:
            raise DeckError(row.line, f"element {number} is defined twice")
        missing = [n for n in nodes if n not in index]
        if missing:
            raise DeckError(row.line, f"node {missing[0]} of element {number} is not defined")
        place[number] = kind, len(table)
        table.append([index[n] for n in nodes])
        if k.get("ELSET"):
            sets.setdefault(k.get("ELSET"), []).append(number)


def _members(k: Keyword, sets: dict[str, list[int]], known: dict) -> list[int]:
    members: list[int] = []
    for row in k.rows:
        if "GENERATE" in k.parameters:
            first, last = row.integer(0), row.integer(1)
            members += range(first, last + 1, row.integer(2) if row.text(2) else 1)
            continue
        for position, text in enumerate(row.fields):
            if not text:
                continue
            if text.lstrip("-").isdigit():
                members.append(row.integer(position))
            elif text.upper() in sets:
                members += sets[text.upper()]
            else:
                raise DeckError(row.line, f"set {text} is not defined")
    unknown = [m for m in members if m not in known]
    if unknown:
        raise DeckError(k.line, f"member {unknown[0]} of the set is not defined")
    return members


def _surface(
    k: Keyword,
    X: Array,
    connectivity: dict[str, list[list[int]]],
    place: dict[int, tuple[str, int]],
    sets: dict[str, list[int]],
) -> geometry.Lines:
    rows: list[list[int]] = []
    for row in k.rows:
        name, face = row.text(0).upper(), row.text(1).upper()
        members = sets.get(name) or ([int(name)] if name.isdigit() else None)
        if members is None:
            raise DeckError(row.line, f"element set {name} is not defined")
        if face not in ("S1", "S2", "S3", "S4"):
            raise DeckError(row.line, f"face '{face}' is not one of S1, S2, S3, S4")
        for number in members:
            kind, position = place[number]
            if kind not in POINTS:
                raise DeckError(row.line, f"element {number} is not a solid")
            order = shapes.FACES_QUADRATIC if NODES[kind] == 8 else shapes.FACES_LINEAR
            rows.append([connectivity[kind][position][i] for i in order[int(face[1]) - 1]])
    return geometry.lines(X, np.array(rows), 3 if len(rows[0]) == 3 else 2)


def _properties(
    keywords: list[Keyword], mesh: Mesh, dynamic_Hz: float | None, long_term: bool
) -> Model:
    materials = read_materials(keywords)
    rubber_of: dict[str, list[tuple[Array, Material, complex | float]]] = {}
    cords: dict[str, list[Cords]] = {}
    stiffness = _hourglass_controls(keywords)
    layers: Keyword | None = None
    for k in keywords:
        if k.name == "SOLID SECTION":
            material = _find(k, materials, k.need("MATERIAL"))
            if material.C10 is None:
                raise DeckError(k.line, f"material {material.name} of a solid is not hyperelastic")
            control = k.get("CONTROLS")
            if control and control not in stiffness:
                raise DeckError(k.line, f"section controls {control} are not defined")
            for kind, rows in _by_type(k, mesh, POINTS).items():
                rubber_of.setdefault(kind, []).append(
                    (rows, material, stiffness.get(control, -1.0))
                )
        elif k.name == "SURFACE SECTION":
            layers = k
        elif k.name == "REBAR LAYER":
            if layers is None:
                raise DeckError(k.line, "*REBAR LAYER must follow a *SURFACE SECTION")
            for kind, rows in _by_type(layers, mesh, ("SFMGAX1", "SFMGAX2")).items():
                for row in k.rows:
                    cords.setdefault(kind, []).append(_layer(k, row, mesh, kind, rows, materials))
    rubbers = [
        _rubber(kind, parts, mesh, dynamic_Hz, long_term) for kind, parts in rubber_of.items()
    ]
    for kind in mesh.blocks:
        if kind in POINTS and kind not in rubber_of:
            raise DeckError(0, f"the {kind} elements have no *SOLID SECTION")
    return Model(mesh, rubbers, [_merge(group) for group in cords.values()])


def _find(k: Keyword, materials: dict[str, Material], name: str) -> Material:
    if name not in materials:
        raise DeckError(k.line, f"material {name} is not defined")
    return materials[name]


def _by_type(k: Keyword, mesh: Mesh, kinds: object) -> dict[str, Array]:
    name = k.need("ELSET")
    if name not in mesh.element_sets:
        raise DeckError(k.line, f"element set {name} is not defined")
    rows: dict[str, list[int]] = {}
    for number in mesh.element_sets[name]:
        kind, position = mesh.place[number]
        if kind not in kinds:  # type: ignore[operator]
            raise DeckError(k.line, f"element {number} of type {kind} cannot have *{k.name}")
        rows.setdefault(kind, []).append(position)
    return {kind: np.array(r) for kind, r in rows.items()}


def _hourglass_controls(keywords: list[Keyword]) -> dict[str, complex | float]:
    """Hourglass shear stiffness (Pa) by name of section controls; -1 = the default 0.005 G."""
    controls: dict[str, complex | float] = {}
    name = ""
    for k in keywords:
        if k.name == "SECTION CONTROLS":
            name = k.need("NAME")
            controls[name] = -1.0
        elif k.name == "HOURGLASS STIFFNESS":
            if not name:
                raise DeckError(k.line, "*HOURGLASS STIFFNESS must follow *SECTION CONTROLS")
            controls[name] = k.only_row().number(0)
    return controls


def _rubber(
    kind: str,
    parts: list[tuple[Array, Material, complex | float]],
    mesh: Mesh,
    dynamic_Hz: float | None,
    long_term: bool,
) -> Rubber:
    solids = mesh.blocks[kind]
    assert isinstance(solids, geometry.Solids)
    e, g = solids.weights.shape
    owner = np.full(e, -1)
    table = []
    for i, (rows, material, hourglass) in enumerate(parts):
        if (owner[rows] >= 0).any():
            raise DeckError(0, f"a {kind} element has two *SOLID SECTION")
        owner[rows] = i
        scale, bulk = material.static_scale(long_term)
        C10, C01, D = material.C10 or 0.0, material.C01, material.inverse_D1
        ratio = material.dynamic_ratio(dynamic_Hz, long_term)
        G = 2 * (C10 + C01) * scale
        table.append(
            [
                C10 * scale,
                C01 * scale,
                D * bulk,
                *ratio,
                material.density,
                0.005 * G if hourglass == -1.0 else hourglass,
            ]
        )
    if (owner < 0).any():
        raise DeckError(0, f"{(owner < 0).sum()} {kind} elements have no *SOLID SECTION")
    C10, C01, D, shear, bulk, density, hourglass = np.array(table).T[:, owner]
    point = lambda values: np.repeat(values, g)
    still = dynamic_Hz is None or not (np.any(shear != 1) or np.any(bulk != 1))
    law = MooneyRivlin(
        point(C10),
        point(C01),
        point(D),
        None if still else point(shear),
        None if still else point(bulk),
    )
    return Rubber(solids, law, density, hourglass)


def _layer(
    k: Keyword, row: Row, mesh: Mesh, kind: str, rows: Array, materials: dict[str, Material]
) -> Cords:
    """Data line: name, area, spacing, position, material, angle from the meridian (degrees)."""
    area, spacing = row.number(1), row.number(2)
    material = _find(k, materials, row.text(4).upper())
    if row.number(3, 0.0) != 0.0:
        raise DeckError(row.line, "the position of a layer in a surface element is 0.0")
    if material.youngs_modulus is None:
        raise DeckError(row.line, f"material {material.name} of a rebar layer is not *ELASTIC")
    if not (np.real(area) > 0 and np.real(spacing) > 0):
        raise DeckError(row.line, "area and spacing of a layer must be positive")
    block = mesh.blocks[kind]
    assert isinstance(block, geometry.Lines)
    lines = geometry.Lines(
        block.connectivity[rows],
        block.N,
        block.slope[rows],
        block.R[rows],
        block.tangent[rows],
        block.weights[rows],
    )
    angle = row.number(5, 0.0) * np.pi / 180
    direction, b0, hoop = geometry.cord_operators(lines, np.cos(angle), np.sin(angle))
    width = spacing * np.ones_like(lines.R)
    if k.get("GEOMETRY") == "ANGULAR":  # spacing in degrees: the cords fan out with the radius
        width = spacing * np.pi / 180 * lines.R
    smeared = area / width
    return Cords(
        lines,
        direction,
        b0,
        hoop,
        (material.youngs_modulus * smeared).ravel(),
        material.density * smeared,
    )


def _merge(parts: list[Cords]) -> Cords:
    if len(parts) == 1:
        return parts[0]
    first = parts[0].lines
    join = lambda pick: np.concatenate([pick(p) for p in parts])
    lines = geometry.Lines(
        join(lambda p: p.lines.connectivity),
        first.N,
        join(lambda p: p.lines.slope),
        join(lambda p: p.lines.R),
        join(lambda p: p.lines.tangent),
        join(lambda p: p.lines.weights),
    )
    return Cords(
        lines,
        join(lambda p: p.direction),
        join(lambda p: p.b0),
        join(lambda p: p.hoop),
        join(lambda p: p.stiffness),
        join(lambda p: p.mass),
    )
