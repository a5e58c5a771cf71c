"""Contents of a user's deck, in words and as data."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from ...files import Json
from .own_deck import OwnDeck
from .solver_deck import SolverDeck
from .text import names_of

LAWS = ("ELASTIC", "HYPERELASTIC", "VISCOELASTIC")


def contents(deck: OwnDeck, flat: SolverDeck) -> Json:
    """Contents of a deck as data, SI where a key has a unit; nodes, elements, faces are counts."""
    mesh, model = flat.mesh, flat.model
    crown = np.array([mesh.nodes[n] for n in mesh.crown])
    held = np.array([mesh.nodes[n] for n in mesh.rim])
    steps = flat.blocks.inflation[0], *flat.blocks.later
    inflation, *later = (step.parameters.get("NAME") or "without a name" for step in steps)
    return {
        "units": deck.units,
        "nodes": len(mesh.nodes),
        "elements": dict(Counter(element.kind for element in model.elements.values())),
        "sections": [
            {"set": name, "material": material}
            for name, material in zip(flat.sections, flat.materials, strict=True)
        ],
        "compounds": {name: laws(flat, name) for name in dict.fromkeys(flat.materials)},
        "plies": [
            {
                "name": ply.name,
                "set": ply.set_name,
                "material": ply.material,
                "area_m2": ply.area_m2,
                "spacing_deg" if ply.angular else "spacing_m": ply.spacing,
                "angle_deg": ply.angle_deg,
            }
            for ply in flat.plies
        ],
        "rim": {"nodes": len(mesh.rim), "radius_m": float(held[:, 0].max())},
        "cavity": {"surface": model.cavity_name, "faces": len(mesh.cavity)},
        "pressure_kPa": flat.pressure_Pa / 1e3,
        "inflation_step": inflation,
        "static_moduli": flat.static_moduli,
        "crown": {
            "nodes": len(crown),
            "radius_m": float(crown[:, 0].max()),
            "half_width_m": float(abs(crown[:, 1]).max()),
        },
        "reflected": model.reflected,
        "marks": list(deck.marks),
        "left_out": list(model.left_out),
        "passed_over": names_of(flat.blocks.passed),
        "later_steps": later,
    }


def laws(flat: SolverDeck, material: str) -> list[str]:
    """The laws of a material: keywords and their options, in small letters."""
    blocks = flat.blocks
    (block,) = (b for b in blocks.model if (b.name, b.get("NAME")) == ("MATERIAL", material))
    laws = (b for b in blocks.options[block] if b.name in LAWS)
    return [", ".join((b.name.lower(), *map(str.lower, b.parameters))) for b in laws]


def words(content: Json, mass_kg: float) -> Iterator[str]:
    """Contents of a deck in sentences."""
    how = {"m": "m, kg, s, Pa", "mm": "mm, t, s, MPa"}[content["units"]]
    kinds = ", ".join(f"{count} {kind}" for kind, count in content["elements"].items())
    half = ", the half made whole" if content["reflected"] else ""
    yield f"units {how}; {mass_kg:.2f} kg without the rim"
    yield f"{content['nodes']} nodes, {kinds}{half}"
    for section in content["sections"]:
        laws = "; ".join(content["compounds"][section["material"]])
        yield f"section {section['set']}: {section['material']} ({laws})"
    for ply in content["plies"]:
        if "spacing_deg" in ply:
            spacing = f"{ply['spacing_deg']:g} degrees"
        else:
            spacing = f"{1e3 * ply['spacing_m']:.4g} mm"
        yield (
            f"ply {ply['name']} on {ply['set']}: {ply['material']}, {1e6 * ply['area_m2']:.4g} mm²"
            f" every {spacing}, {ply['angle_deg']:g} degrees from the meridian"
        )
    rim, crown = content["rim"], content["crown"]
    yield f"rim: holds {rim['nodes']} nodes, up to r = {1e3 * rim['radius_m']:.1f} mm"
    yield (
        f"cavity: surface {content['cavity']['surface']}, {content['cavity']['faces']} faces,"
        f" {content['pressure_kPa']:g} kPa by the step {content['inflation_step']},"
        f" {content['static_moduli'].replace('_', ' ')} moduli"
    )
    yield (
        f"crown: {crown['nodes']} nodes of the outer surface, {2e3 * crown['half_width_m']:.1f} mm"
        f" wide, radius {1e3 * crown['radius_m']:.1f} mm"
    )
    for key, start, between in (
        ("marks", "marks: ", ", "),
        ("left_out", "left out: ", "; "),
        ("passed_over", "ignored, because they change no result: *", ", *"),
        ("later_steps", "left out, because they come after the inflation: steps ", ", "),
    ):
        if content[key]:
            yield start + between.join(content[key])
