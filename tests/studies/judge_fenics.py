"""The unloaded tyre's modes by FEniCSx and SLEPc, of no code of the tool's.

    /usr/bin/python3 -m tests.studies.judge_fenics PROBLEM.json RESULT.json
    (apt-get install python3-dolfinx: Debian bookworm has 0.5.2)

PROBLEM: nodes, elements and constants of a section, or the table of its stations, which is then
meshed here (`fenics.py` writes both). u = (u_r, u_theta, u_z) in the frame of the reference angle,
g = du/dTheta. A vibration a(R, Z) cos(n Theta) - b(R, Z) sin(n Theta) about the inflated state u0
is u0 + a with g = -n b in one section and u0 + b with g = n a in another, a quarter of a wave
before it; the sum of both sections' second variations is twice their mean round the tyre. So K(n)
is the derivative of the same three dimensional energies as the inflation's, and nobody has written
a tangent: UFL differentiates. SI units; the axle is z.
"""

from __future__ import annotations

import json
import logging
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from .judge_section import LINES, section

EQUILIBRIUM = 1e-8  # of the first residual
MAX_ITERATIONS = 40
TRUE_STRESS = "true stress"  # a law of cords
FEW = 100  # elements: the optimiser takes longer than it saves
logging.disable(logging.INFO)  # of the compiler


def gradient(u: Any, g: Any, r: Any) -> Any:
    """F in (r, theta, z) from u and its derivative by Theta."""
    return ufl.Identity(3) + moved(u, g, r)


def moved(u: Any, g: Any, r: Any) -> Any:
    """F - 1."""
    du = ufl.grad(u)
    hoop = [(g[0] - u[1]) / r, (g[1] + u[0]) / r, g[2] / r]
    rows = [[du[i, 0], hoop[i], du[i, 1]] for i in range(3)]
    return ufl.as_matrix(rows)


def rubber(F: Any, c: dict[str, Any], volume: str) -> Any:
    """Mooney and Rivlin's energy, J/m3, with (J - 1)^2 / D1 or ln^2 J / D1."""
    J, C = ufl.det(F), F.T * F
    first = ufl.tr(C)
    second = (first**2 - ufl.inner(C, C)) / 2
    change = {"J - 1": J - 1, "ln J": ufl.ln(J)}[volume]
    shear = c["C10"] * (J ** (-2 / 3) * first - 3) + c["C01"] * (J ** (-4 / 3) * second - 3)
    return shear + change**2 / c["D1"]


def cord(q: Any, stiffness: Any, law: str) -> Any:
    """Energy of cords that are carried to q: E A / 2 s or E A / 2 s t times a strain squared; of
    `TRUE_STRESS`, which `tension` has, none."""
    if law == TRUE_STRESS:
        return 0 * stiffness
    square = ufl.dot(q, q)
    strain = {
        "logarithmic": ufl.ln(square) / 2,
        "nominal": ufl.sqrt(square) - 1,
        "Green": (square - 1) / 2,  # St Venant and Kirchhoff
    }[law]
    return stiffness * strain**2 / 2


def tension(q: Any, stiffness: Any) -> Any:
    """Pull of cords that are carried to q, as ABAQUS's manual states rebars of surface elements
    (Theory Guide, 3.7.3): true stress is E times the logarithmic strain, and the rebar's volume
    stays, so that its area is A over the stretch."""
    stretch = ufl.sqrt(ufl.dot(q, q))
    stress_times_area = stiffness * ufl.ln(stretch) / stretch
    return stress_times_area * q / stretch


class Section:
    """Mesh and constants. Cords on a line are data of the element inside it."""

    def __init__(self, problem: dict[str, Any]) -> None:
        self.problem = p = problem
        nodes, cells, rows, cords, inner, held = meshed(p) if "stations" in p else given(p)
        shape = {6: "triangle", 9: "quadrilateral"}[cells.shape[1]]
        curved = ufl.Mesh(ufl.VectorElement("Lagrange", shape, 2))
        self.mesh = mesh.create_mesh(MPI.COMM_SELF, cells, nodes, curved)
        self.W = fem.VectorFunctionSpace(self.mesh, tuple(p["element"]), 6)
        for pair in ((1, 0), (1, 2), (2, 0)):
            self.mesh.topology.create_connectivity(*pair)
        self.cell = np.array(self.mesh.topology.original_cell_index)  # the problem's number
        self.number = self._corners()
        self.points = nodes[self.number]
        constants = {key: np.resize(p[key], len(cells)) for key in ("C10", "C01", "D1", "density")}
        self.rubber = {key: self._by_cell(values) for key, values in constants.items()}
        self.row = self._by_cell(rows)
        edges = self._edges()
        facet = lambda ends: edges[frozenset(map(int, ends[:2]))]
        table = np.zeros((len(cells), 3))  # E A / s, angle, mass per area
        for each in cords:
            sides = self.cell[self.mesh.topology.connectivity(1, 2).links(facet(each))]
            table[min(sides, key=lambda c: rows[c])] = each[2:]
        self.cords = [self._by_cell(column) for column in table.T]
        table = np.zeros((len(cells), 5))  # of cords that fill elements: Pa, direction, density
        for c, *data in p.get("plies", []):
            table[c] = data
        self.plies = [self._by_cell(column) for column in table.T] if "plies" in p else []
        tags = {facet(each): 1 for each in cords} | {facet(each): 2 for each in inner}
        tagged = np.array(sorted(tags.items()), np.int32).T.copy()
        self.tags = mesh.meshtags(self.mesh, 1, *tagged)
        self.held = np.array([facet(each) for each in held], np.int32)

    def _by_cell(self, values: np.ndarray) -> fem.Function:
        function = fem.Function(fem.FunctionSpace(self.mesh, ("DG", 0)))
        function.x.array[:] = np.asarray(values, float)[self.cell]
        return function

    def _edges(self) -> dict[frozenset[int], int]:
        """Facets by the problem's numbers of their two ends."""
        ends = self.mesh.topology.connectivity(1, 0)
        count = self.mesh.topology.index_map(1).size_local
        return {frozenset(map(int, self.number[ends.links(f)])): f for f in range(count)}

    def _corners(self) -> np.ndarray:
        """The problem's number of each element corner."""
        top, geometry = self.mesh.topology, self.mesh.geometry
        given, corners = np.array(geometry.input_global_indices), top.connectivity(2, 0)
        number = np.empty(top.index_map(0).size_local, int)
        for c in range(len(self.cell)):
            own = corners.links(c)
            number[own] = given[geometry.dofmap.links(c)[: len(own)]]
        return number


def given(p: dict[str, Any]) -> tuple[Any, ...]:
    """The problem's own mesh, with the ninth node where eight nodes' map has the middle."""
    nodes, quads = np.array(p["nodes"]), np.array(p["quads"])
    middle = nodes[quads[:, 4:]].sum(1) / 2 - nodes[quads[:, :4]].sum(1) / 4
    a, b, c, d, ab, bc, cd, da = quads.T
    cells = np.stack([a, b, d, c, ab, da, bc, cd, len(nodes) + np.arange(len(quads))], 1)
    rows, cords, inner, held = (p[key] for key in ("rows", "cords", "inner", "held"))
    return np.concatenate([nodes, middle]), cells, rows, cords, inner, held


def meshed(p: dict[str, Any]) -> tuple[Any, ...]:
    """Triangles of six nodes between a section's lines, two to a cell of the grid."""
    lines, belted = section(p["stations"], *p["along"])
    layers = [lines[0]]
    for below, above, count in zip(lines, lines[1:], p["rows"], strict=False):
        layers += [below + t * (above - below) for t in np.arange(1, 2 * count + 1) / 2 / count]
    high, wide = len(layers), lines.shape[1]
    number = np.arange(high * wide).reshape(high, wide)
    at = lambda i, j: number[i : high - 2 + i : 2, j : wide - 2 + j : 2].ravel()
    corners = at(0, 0), at(2, 0), at(2, 2), at(0, 2), at(1, 1)  # the last the diagonal's middle
    a, b, c, d, ac = corners
    # after its corners a triangle has the middles of the sides that they face
    lower = np.stack([a, c, d, at(1, 2), at(0, 1), ac], 1)
    upper = np.stack([a, b, c, at(2, 1), ac, at(1, 0)], 1)
    row = np.repeat(np.arange(high // 2), wide // 2)
    cords = []
    for name, cord in p["cords"].items():
        k = LINES.index(name)
        i = 2 * sum(p["rows"][:k])
        per_area = cord["area"] / cord["spacing"]
        data = cord["modulus"] * per_area, np.radians(cord["angle_deg"]), cord["density"] * per_area
        cords += [
            (number[i, j], number[i, j + 2], *data)
            for j in range(0, wide - 1, 2)
            if name == "ply" or belted[j + 1]
        ]
    inner = [(number[0, j], number[0, j + 2]) for j in range(0, wide - 1, 2)]
    held = [(number[i, j], number[i + 2, j]) for j in (0, -1) for i in range(0, high - 1, 2)]
    nodes = np.array(layers).reshape(-1, 2)
    return nodes, np.concatenate([lower, upper]), np.tile(row, 2), cords, inner, held


class Tyre:
    """Forms, inflation and modes."""

    def __init__(self, section: Section) -> None:
        self.s, self.p = section, section.problem
        msh, W = section.mesh, section.W
        few, full = self.p["quadrature"], self.p["full_quadrature"]  # full: of mass and gas

        def measure(kind: str, degree: int) -> Any:
            data = {} if kind == "dx" else {"subdomain_data": section.tags}
            return ufl.Measure(kind, msh, metadata={"quadrature_degree": degree}, **data)

        self.dx, self.dx_mass = measure("dx", few), measure("dx", full)
        self.dS, self.ds = measure("dS", few), measure("ds", full)
        self.R = ufl.SpatialCoordinate(msh)[0]
        self.N = ufl.FacetNormal(msh)
        constant = lambda: fem.Constant(msh, PETSc.ScalarType(0))
        self.pressure, self.help, self.n = constant(), constant(), constant()
        self.filler = constant()  # of a ply's stiffness, isotropic: CalculiX's deck needs it
        self.filler.value = self.p.get("filler", 0.0)
        self.state, change = fem.Function(W), fem.Function(W)  # u0 twice; nothing
        test, trial = ufl.TestFunction(W), ufl.TrialFunction(W)
        forces = self.forces(change, test)
        self.force = self.compiled(forces)
        self.stiffness = self.compiled(ufl.derivative(forces, change, trial))
        self.mass = self.compiled(self.inertia(trial, test))
        dofs = fem.locate_dofs_topological(W, 1, section.held)
        self.held = [fem.dirichletbc(fem.Function(W), dofs)]

    def compiled(self, form: Any) -> Any:
        """A form in machine code; waits for another process that is at it."""
        level = "-O2" if len(self.s.cell) > FEW else "-O0"
        options = {"timeout": 600, "cffi_extra_compile_args": [level]}
        return fem.form(form, jit_params=options)

    def forces(self, change: fem.Function, test: Any) -> Any:
        """Virtual work in both sections, of all but inertia."""
        (u0, _), (a, b), (va, vb) = halves(self.state), halves(change), halves(test)
        there = (u0 + a, -self.n * b), (u0 + b, self.n * a)
        energy = sum(self.energy(u, g) for u, g in there)
        work = ufl.derivative(energy, change, test)
        work += sum(self.gas(u, g, v) for (u, g), v in zip(there, (va, vb), strict=True))
        if self.p["cord_law"] == TRUE_STRESS:
            moves = (va, -self.n * vb), (vb, self.n * va)
            work += sum(self.pull(*at, *by) for at, by in zip(there, moves, strict=True))
        # slack cords do not bear yet: a stiffness that is taken away again
        moved = self.state + change
        return work + self.help * ufl.inner(ufl.grad(moved), ufl.grad(test)) * self.R * self.dx

    def energy(self, u: Any, g: Any) -> Any:
        """Energy of rubber and cords, J per radian."""
        F, s = gradient(u, g, self.R), self.s
        inside = rubber(F, s.rubber, self.p["volume_law"])
        if s.plies:
            stiffness, *along = s.plies[:4]
            inside += cord(F * ufl.as_vector(along), stiffness, self.p["cord_law"])
            Green = (F.T * F - ufl.Identity(3)) / 2
            inside += self.filler * stiffness / 2 * ufl.inner(Green, Green)
        lines = cord(F * self.along, s.cords[0], self.p["cord_law"])
        return inside * self.R * self.dx + self.on_lines(lines)

    @property
    def along(self) -> Any:
        """Direction of the cords on a line."""
        angle, N = self.s.cords[1], self.N
        c = ufl.cos(angle)
        return ufl.as_vector([-c * N[1], ufl.sin(angle), c * N[0]])

    def pull(self, u: Any, g: Any, v: Any, dg: Any) -> Any:
        """Virtual work of the cords' tension."""
        F, dF = gradient(u, g, self.R), moved(v, dg, self.R)
        return self.on_lines(ufl.dot(tension(F * self.along, self.s.cords[0]), dF * self.along))

    def on_lines(self, per_area: Any) -> Any:
        """Integral over the cord lines of what the element inside each has."""
        row, value = self.s.row, per_area * self.R
        plus, minus = (ufl.conditional(ufl.lt(row(a), row(b)), 1.0, 0.0) for a, b in ("+-", "-+"))
        return (plus * value("+") + minus * value("-")) * self.dS(1)

    def gas(self, u: Any, g: Any, v: Any) -> Any:
        """Virtual work that the gas takes: p n da = p cof(F) N dA on the deformed surface."""
        F, N = gradient(u, g, self.R), self.N
        r, t, z = (F[:, k] for k in range(3))
        area = N[0] * ufl.cross(t, z) + N[1] * ufl.cross(r, t)
        return self.pressure * ufl.dot(v, area) * self.R * self.ds(2)

    def inertia(self, u: Any, v: Any) -> Any:
        """Inertia form of rubber and cords, kg m2 per radian."""
        s, product = self.s, ufl.inner(u, v)
        inside = s.rubber["density"] + (s.plies[4] if s.plies else 0)
        return inside * product * self.R * self.dx_mass + self.on_lines(s.cords[2] * product)

    def inflate(self) -> list[int]:
        """Newton's method up to the pressure; iterations of each step."""
        solver, taken = PETSc.KSP().create(MPI.COMM_SELF), []
        by_factors(solver)
        for share, help_Pa in self.p["inflation"]:
            self.pressure.value, self.help.value = share * self.p["pressure"], help_Pa
            sizes: list[float] = []
            while len(sizes) < MAX_ITERATIONS:
                b = petsc.assemble_vector(self.force)
                petsc.set_bc(b, self.held, scale=0.0)
                sizes.append(b.norm())
                if sizes[-1] <= EQUILIBRIUM * sizes[0]:
                    break
                solver.setOperators(self.assembled(self.stiffness))
                step = b.duplicate()
                solver.solve(b, step)
                self.state.vector.axpy(-1.0, step)
            else:
                raise RuntimeError(f"no equilibrium: of {sizes[0]:g} N {sizes[-1]:g} are left")
            taken.append(len(sizes) - 1)
        return taken

    def assembled(self, form: Any, diagonal: float = 1.0) -> PETSc.Mat:
        matrix = petsc.assemble_matrix(form, self.held, diagonal)
        matrix.assemble()
        return matrix

    def modes(self, n: int) -> list[dict[str, Any]]:
        """The lowest modes of harmonic n, each once."""
        self.n.value = n
        K, M = self.assembled(self.stiffness), self.assembled(self.mass, 0.0)
        other = K.duplicate(copy=True)
        other.transpose()
        K.axpy(1.0, other)
        K.scale(0.5)  # the gas' part is symmetric but for its quadrature, as ends are held
        other.axpy(-1.0, K)
        solver, wanted = SLEPc.EPS().create(MPI.COMM_SELF), 2 * self.p["modes"]
        solver.setOperators(K, M)
        solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        solver.setDimensions(wanted + 2)
        solver.setTolerances(1e-12)
        solver.setTarget(self.p.get("target", 0.0))
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        solver.getST().setType("sinvert")
        by_factors(solver.getST().getKSP())
        solver.solve()
        values = np.array([solver.getEigenvalue(i).real for i in range(solver.getConverged())])
        vector, result = fem.Function(self.s.W), []
        for i in np.argsort(values)[:wanted:2]:  # (a, b) and (-b, a) are one vibration
            solver.getEigenvector(i, vector.vector)
            pair = self.at_corners(vector)
            result.append(
                {
                    "n": n,
                    "eigenvalue": float(values[i]),
                    "cos": pair[:, :3].tolist(),
                    "sin": pair[:, 3:].tolist(),
                    "asymmetry": other.norm() / K.norm(),
                }
            )
        return result

    def at_corners(self, field: fem.Function) -> np.ndarray:
        """Values (k, 6) at the elements' corners, in the order of `Section.vertices`."""
        s = self.s
        linear = fem.VectorFunctionSpace(s.mesh, ("Lagrange", 1), 6)
        at = fem.Function(linear)
        at.interpolate(field)
        corners = s.mesh.topology.connectivity(2, 0)
        place = np.empty(len(s.number), int)
        for c in range(len(s.cell)):
            place[corners.links(c)] = linear.dofmap.cell_dofs(c)
        return at.x.array.reshape(-1, 6)[place]

    def mass_kg(self) -> float:
        """Mass of the whole tyre, kg, including the part that the rim holds."""
        one = ufl.as_vector([1.0, 0, 0])
        return 2 * np.pi * fem.assemble_scalar(self.compiled(self.inertia(one, one)))


def halves(pair: Any) -> tuple[Any, Any]:
    """(a, b) of a field of six components."""
    part = lambda own: ufl.as_vector([pair[i] for i in own])
    return part(range(3)), part(range(3, 6))


def by_factors(solver: PETSc.KSP) -> None:
    """Solve by MUMPS' factors."""
    solver.setType("preonly")
    solver.getPC().setType("lu")
    solver.getPC().setFactorSolverType("mumps")


def main() -> None:
    problem, started = json.loads(Path(sys.argv[1]).read_text()), time.time()
    section = Section(problem)
    tyre = Tyre(section)
    print(f"forms: {time.time() - started:.1f} s", flush=True)
    iterations = tyre.inflate()
    modes = [mode for n in problem["harmonics"] for mode in tyre.modes(n)]
    for mode in modes:
        print(mode["n"], f"{mode['eigenvalue']:.9g}", flush=True)
    result = {
        "corners": section.number.tolist(),
        "points": section.points.tolist(),
        "displacement": tyre.at_corners(tyre.state)[:, :3].tolist(),
        "mass_kg": tyre.mass_kg(),
        "equations": len(tyre.state.x.array),
        "iterations": iterations,
        "modes": modes,
        "seconds": time.time() - started,
    }
    Path(sys.argv[2]).write_text(json.dumps(result) + "\n")
    print(f"{result['equations']} equations, {result['seconds']:.1f} s")


if __name__ == "__main__":
    main()
