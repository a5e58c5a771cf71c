"""Words of keyword lines as the manual spells them in full.

ABAQUS ignores blanks and case, and takes a beginning that only one word has; a word that is exact
is never an abbreviation. A word that is in no list stays as it is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache

from .table import RULES

WITHOUT_RECORD = """
acoustic contribution, acoustic flow velocity, acoustic wave formulation, adaptive mesh, adaptive
mesh constraint, adaptive mesh controls, adaptive mesh refinement, adjust, anisotropic hyperelastic,
anneal, anneal temperature, annealing, aqua, asymmetric-axisymmetric, axial, base motion, baseline
correction, beam added inertia, beam fluid inertia, beam general section, beam section, beam section
generate, beam section offset, blockage, bond, brittle cracking, brittle failure, brittle shear,
buckle, buckling envelope, buckling length, buckling reduction factors, bulk viscosity, c added
mass, cap creep, cap hardening, cap plasticity, cast iron compression hardening, cast iron
plasticity, cast iron tension hardening, cavity definition, cecharge, cecurrent, centroid, cfd,
cfilm, cflow, cflux, clay hardening, clay plasticity, co-simulation, co-simulation controls,
co-simulation region, cohesive behavior, cohesive section, composite modal damping, composite
section, concrete, concrete compression damage, concrete compression hardening, concrete damaged
plasticity, concrete failure, concrete tension damage, concrete tension stiffening, connector
behavior, connector constitutive reference, connector damage evolution, connector damage initiation,
connector damping, connector derived component, connector elasticity, connector failure, connector
friction, connector hardening, connector load, connector lock, connector motion, connector
plasticity, connector potential, connector section, connector stop, connector uniaxial behavior,
constituent, constraint controls, contact permeability, contact response, conwep charge property,
correlation, coupled temperature-displacement, coupled thermal-electrical, cradiate, creep, creep
strain rate control, crushable foam, crushable foam hardening, cycled plastic, cyclic, cyclic
hardening, cyclic symmetry model, d added mass, d em potential, damage evolution, damage initiation,
damage stabilization, damping controls, dashpot, debond, decharge, decurrent, deformation
plasticity, depvar, design gradient, design response, detonation point, dflow, dflux, dielectric,
diffusivity, direct cyclic, discrete section, display body, distributing coupling, distribution,
distribution table, drag chain, drucker prager, drucker prager creep, drucker prager hardening, dsa
controls, dsecharge, dsecurrent, dsflow, dsflux, dynamic, dynamic temperature-displacement,
electrical conductivity, electromagnetic, element matrix output, element operator output, element
recovery matrix, element response, emissivity, end load case, energy equation solver, enrichment,
enrichment activation, eos, eos compaction, epjoint, eulerian boundary, eulerian mesh motion,
eulerian section, event series, external field, extreme element value, extreme node value, extreme
value, fabric, fail strain, fail stress, failure ratios, fastener, fastener property, field, film,
film property, fixed mass scaling, flexible body, flow, fluid boundary, fluid bulk modulus, fluid
density, fluid exchange, fluid exchange activation, fluid exchange property, fluid expansion, fluid
flux, fluid inflator, fluid inflator activation, fluid inflator mixture, fluid inflator property,
fluid leakoff, fluid link, fluid property, fluid section, foundation, fracture criterion, frame
section, gap, gap conductance, gap electrical conductance, gap flow, gap heat generation, gap
radiation, gas specific heat, gasket behavior, gasket contact area, gasket elasticity, gasket
section, gasket thickness behavior, gel, geostatic, global damping, heat generation, heat transfer,
heatcap, hyperfoam, hypoelastic, impedance, impedance property, imperfection, import, import
controls, import elset, import nset, incident wave, incident wave fluid property, incident wave
interaction, incident wave interaction property, incident wave property, incident wave reflection,
include, incrementation output, inelastic heat fraction, inertia relief, interface, joint, joint
elasticity, joint plasticity, jointed material, joule heat fraction, kappa, kinematic coupling,
latent heat, load case, loading data, low density foam, m1, m2, magnetic permeability,
magnetostatic, mass adjust, mass diffusion, mass flow rate, matrix, matrix assemble, matrix check,
matrix generate, matrix input, matrix output, mean field homogenization, media transport, modal
damping, modal dynamic, mohr coulomb, mohr coulomb hardening, moisture swelling, momentum equation
solver, motion, nmap, no tension, nodal energy rate, nodal thickness, node response, nonlinear bh,
nonstructural mass, normal, ornl, parameter dependence, parameter shape variation, parameter table,
periodic, periodic media, permanent magnetization, permeability, piezoelectric, pipe-soil
interaction, pipe-soil stiffness, plastic, plastic axial, plastic m1, plastic m2, plastic torque,
porous bulk moduli, porous elastic, porous failure criteria, porous metal plasticity, post output,
potential, pressure equation solver, pressure penetration, pressure stress, prestress hold,
probability density function, property table type, psd-definition, radiate, radiation file,
radiation output, radiation print, radiation symmetry, radiation viewfactor, random response, rate
dependent, ratios, reflection, release, response spectrum, retained nodal dofs, rigid surface,
section origin, section points, select cyclic symmetry modes, select eigenmodes, sfilm, sflow, shear
center, shear failure, shear retention, shell general section, shell to solid coupling, simpedance,
slide line, sload, soft rock hardening, soft rock plasticity, soils, solubility, solution technique,
sorption, spectrum, sradiate, steady state criteria, steady state detection, steady state dynamics,
steady state transport, step control, submodel, substructure copy, substructure damping,
substructure damping controls, substructure delete, substructure directory, substructure generate,
substructure load case, substructure matrix output, substructure modal damping, substructure output,
substructure path, substructure property, superelastic, surface flaw, surface property, swelling,
table collection, tensile failure, tension cutoff, tension stiffening, thermal expansion, torque,
torque print, tracer particle, transport velocity, transverse shear, transverse shear stiffness,
triaxial test data, trs, turbulence equation solver, turbulence model, undex charge property,
uniaxial, unloading data, user defined field, user element, user output variables, variable mass
scaling, variation, viewfactor output, visco, viscosity, viscous, void nucleation, wave, wind
"""
KEYWORD_NAMES = sorted((*RULES, *" ".join(WITHOUT_RECORD.split()).upper().split(", ")))


EVERYWHERE = ("INPUT",)  # a parameter of every keyword that has data lines


def squeezed(text: str) -> str:
    """A word without blanks, in upper case."""
    return "".join(text.upper().split())


def named(text: str) -> str:
    """A name as ABAQUS compares them: blanks count only between quotation marks."""
    text = text.strip()
    if len(text) > 1 and text[0] == text[-1] == '"':
        return " ".join(text[1:-1].upper().split())
    return squeezed(text.strip('"'))


def full(word: str, words: Iterable[str], mark: str = "") -> str:
    """The one of ``words`` that is meant; an error has ``mark`` before each. Raises ValueError."""
    short = squeezed(word)
    if not short:
        return ""
    spellings = {squeezed(each): each for each in words}
    if short in spellings:
        return spellings[short]
    fitting = [each for key, each in spellings.items() if key.startswith(short)]
    if len(fitting) > 1:
        several = " or ".join(mark + each for each in fitting)
        raise ValueError(f"'{word.strip()}' may be {several}: spell it out")
    return fitting[0] if fitting else " ".join(word.upper().split())


@cache
def full_keyword(word: str) -> str:
    """A keyword in full. Raises ValueError."""
    return full(word, KEYWORD_NAMES, "*")


def full_parameters(keyword: str, given: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Parameters of a keyword with their values, both in full. Raises ValueError."""
    rule = RULES.get(keyword)
    known = rule.parameters if rule else {}
    for key, value in given:
        name = full(key, (*known, *EVERYWHERE))
        words = known.get(name, "any")
        if words.islower():  # a kind of value, such as a number or a name
            yield name, value
        else:
            yield name, full(value.strip('"'), words.split("|"))
