"""What fills the mesh: rubber and cords with their constants, from sections and layers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..deck.keywords import DeckError, Keyword, Row
from . import elements
from .materials import Law, Material, read_materials
from .mesh import POINTS, Mesh, read_mesh
from .parts.rubber import MooneyRivlin

Array = np.ndarray


@dataclass
class Rubber:
    """One block of solids with constants per Gauss point (e * g,) and density per element.

    ``law`` (e * g,): place in the model's laws of frequency, -1 = none.
    """

    solids: elements.Solids
    material: MooneyRivlin
    density: Array
    hourglass_stiffness: Array
    law: Array


@dataclass
class Cords:
    """All rebar layers of one element type: stiffness E A / s (N/m), mass A rho / s (kg/m2)."""

    lines: elements.Lines
    direction: Array
    b0: Array
    hoop: Array
    stiffness: Array
    mass: Array


@dataclass
class Model:
    """The tyre's section, ready for mechanics.

    spin2: square of the spin about the axle, rad2/s2.
    """

    mesh: Mesh
    rubbers: list[Rubber]
    cords: list[Cords]
    laws: list[Law] = field(default_factory=list)
    spin2: complex | float = 0.0


def build(
    keywords: list[Keyword], dynamic_Hz: float | None, long_term: bool, own_frequency: bool = False
) -> Model:
    """The model of a section job.

    ``dynamic_Hz``: evaluate the rubber's vibration modulus at this frequency, None = static;
    ``long_term``: the static state is relaxed (else instantaneous moduli); ``own_frequency``:
    rubber with a law of frequency keeps its static modulus, the law is in the model's.
    Raises DeckError.
    """
    mesh = read_mesh(keywords)
    materials = read_materials(keywords)
    laws: list[Law] = []
    if own_frequency:
        laws = list(dict.fromkeys(m.law for m in materials.values() if m.law is not None))
    return _properties(keywords, mesh, materials, laws, dynamic_Hz, long_term)


def _properties(
    keywords: list[Keyword],
    mesh: Mesh,
    materials: dict[str, Material],
    laws: list[Law],
    dynamic_Hz: float | None,
    long_term: bool,
) -> Model:
    rubber_of: dict[str, list[tuple[Array, Material, complex | float]]] = {}
    cords: dict[str, list[Cords]] = {}
    controls = {k.need("NAME") for k in keywords if k.name == "SECTION CONTROLS"}
    layers: Keyword | None = None
    for before, k, after in zip([None, *keywords], keywords, [*keywords[1:], None], strict=False):
        if k.name == "SOLID SECTION":
            material = _find(k, materials, k.need("MATERIAL"))
            if material.C10 is None:
                raise DeckError(k.line, f"material {material.name} of a solid is not hyperelastic")
            control = k.get("CONTROLS")
            if control and control not in controls:
                raise DeckError(k.line, f"section controls {control} are not defined")
            for kind, rows in _by_type(k, mesh, POINTS).items():
                rubber_of.setdefault(kind, []).append((rows, material, _hourglass(after)))
        elif k.name == "HOURGLASS STIFFNESS":
            if before is None or before.name != "SOLID SECTION":
                raise DeckError(
                    k.line,
                    "*HOURGLASS STIFFNESS must stand right under the *SOLID SECTION that it is of",
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
        _rubber(kind, parts, mesh, laws, dynamic_Hz, long_term) for kind, parts in rubber_of.items()
    ]
    for kind in mesh.blocks:
        if kind in POINTS and kind not in rubber_of:
            raise DeckError(0, f"the {kind} elements have no *SOLID SECTION")
    return Model(mesh, rubbers, [_merge(group) for group in cords.values()], laws)


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


def _hourglass(after: Keyword | None) -> complex | float:
    """Hourglass shear stiffness (Pa) from the keyword after a section; -1 = the default 0.005 G."""
    if after is None or after.name != "HOURGLASS STIFFNESS":
        return -1.0
    return after.only_row().number(0)


def _rubber(
    kind: str,
    parts: list[tuple[Array, Material, complex | float]],
    mesh: Mesh,
    laws: list[Law],
    dynamic_Hz: float | None,
    long_term: bool,
) -> Rubber:
    solids = mesh.blocks[kind]
    assert isinstance(solids, elements.Solids)
    e, g = solids.weights.shape
    owner = np.full(e, -1)
    table = []
    for i, (rows, material, hourglass) in enumerate(parts):
        if (owner[rows] >= 0).any():
            raise DeckError(0, f"a {kind} element has two *SOLID SECTION")
        owner[rows] = i
        scale, bulk = material.static_scale(long_term)
        C10, C01, D = material.C10 or 0.0, material.C01, material.inverse_D1
        place = laws.index(material.law) if material.law in laws else -1
        ratio = (1.0, 1.0) if place >= 0 else material.dynamic_ratio(dynamic_Hz, long_term)
        G = 2 * (C10 + C01) * scale
        table.append(
            [
                C10 * scale,
                C01 * scale,
                D * bulk,
                *ratio,
                material.density,
                0.005 * G if hourglass == -1.0 else hourglass,
                place,
            ]
        )
    if (owner < 0).any():
        raise DeckError(0, f"{(owner < 0).sum()} {kind} elements have no *SOLID SECTION")
    C10, C01, D, shear, bulk, density, hourglass, law_of = np.array(table).T[:, owner]
    point = lambda values: np.repeat(values, g)
    still = dynamic_Hz is None or not (np.any(shear != 1) or np.any(bulk != 1))
    law = MooneyRivlin(
        point(C10),
        point(C01),
        point(D),
        None if still else point(shear),
        None if still else point(bulk),
    )
    return Rubber(solids, law, density, hourglass, point(law_of.real.astype(int)))


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
    assert isinstance(block, elements.Lines)
    lines = elements.Lines(
        block.connectivity[rows],
        block.N,
        block.slope[rows],
        block.R[rows],
        block.tangent[rows],
        block.weights[rows],
    )
    angle = row.number(5, 0.0) * np.pi / 180
    direction, b0, hoop = elements.cord_operators(lines, np.cos(angle), np.sin(angle))
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
    lines = elements.Lines(
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


def stiffened(model: Model) -> list[Model]:
    """Per law a model with the tangent dK_l: the rubber's own, without its initial stress."""
    models = []
    for law in range(len(model.laws)):
        rubbers = []
        for r in model.rubbers:
            own, m = r.law == law, r.material
            shear = replace(
                m,
                C10=m.C10 * own,
                C01=m.C01 * own,
                inverse_D1=0.0 * m.inverse_D1,
                shear_ratio=None,
                bulk_ratio=None,
                stressed=False,
            )
            rubbers.append(replace(r, material=shear, hourglass_stiffness=0 * r.density))
        models.append(replace(model, rubbers=rubbers, cords=[]))
    return models
