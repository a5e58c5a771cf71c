"""The tyre on a flat road by GetFEM, of no code of the tool's: force, area, stiffness, modes.

    /usr/bin/python3 -m tests.studies.judge_getfem PROBLEM.json RESULT.json    (python3-getfem)

PROBLEM: numbers of the case alone (`judge.py` takes them from it), mesh and deflections. The tyre
is meshed here, whole, in bricks of 20 nodes: full integration of the distortion, reduced of the
volume's change. Cords are their law's energy on faces inside the rubber, the gas a pressure that
follows the deformed inner surface, the road a penalty on as many points as the patch's edge needs.
GetFEM differentiates the energies; Newton's method is below. SI units; x is down, z the axle.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import getfem as gf
import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from .judge_section import LINES, section

gf.util("trace level", 0)
gf.util("warning level", 0)
F = "(Id(3)+Grad_u)"
N = "Normal"


def cross(a: str, b: str) -> str:
    """a x b in GetFEM's language."""
    rows = (f"({a})({i})*({b})({j})-({a})({j})*({b})({i})" for i, j in ((2, 3), (3, 1), (1, 2)))
    return f"[{','.join(rows)}]"


ROUND = "[-X(2),X(1),0]"
# unit vectors in a face: along the section and round the tyre
MERIDIAN = f"Normalized({cross(N, ROUND)})"
CIRCLE = f"Normalized({cross(cross(N, ROUND), N)})"
TOUCHES = "Heaviside(X(1)+w(1)-H)"
DEFORMED = f"(Det({F})*Inv({F})'*{N})"  # n da / dA


class Tyre:
    """Mesh, model and Newton's method."""

    def __init__(self, problem: dict) -> None:
        self.problem = problem
        lines, self.belted = section(problem["stations"], *problem["along"])
        split = problem["rows"]
        layers = [lines[0]]
        for below, above, count in zip(lines, lines[1:], split, strict=False):
            layers += [below + t * (above - below) for t in np.arange(1, 2 * count + 1) / 2 / count]
        self.grid = np.array(layers)
        self.edges = np.cumsum([0, *split])
        half = np.radians(problem["angles_deg"])
        whole = np.concatenate([half[::-1], half])
        ends = np.concatenate([[0.0], np.cumsum(whole)]) - np.pi
        self.angles = np.empty(2 * len(whole) + 1)
        self.angles[::2], self.angles[1::2] = ends, (ends[1:] + ends[:-1]) / 2
        self.angles[-1] = self.angles[0]
        self._mesh()
        self._model()

    def _mesh(self) -> None:
        trans = gf.GeoTrans("GT_Q2_INCOMPLETE(3)")
        places = np.rint(2 * trans.pts()).astype(int)  # (along, across, round), half elements
        self.mesh = mesh = gf.Mesh("empty", 3)
        high, wide, _ = self.grid.shape
        faces = {name: [] for name in ("inner", "tread", "rim", "ply", "belt1", "belt2")}
        # faces of the reference brick by the coordinate that is constant there
        of = {}
        for j in range(0, wide - 1, 2):
            for i in range(0, high - 1, 2):
                for a in range(0, len(self.angles) - 1, 2):
                    r, z = self.grid[i + places[1], j + places[0]].T
                    angle = self.angles[a + places[2]]
                    pts = np.stack([r * np.cos(angle), r * np.sin(angle), z])
                    convex = int(mesh.add_convex(trans, pts)[0])
                    if not of:
                        of = self._faces(convex, pts)
                    row = i // 2
                    faces["inner"] += [(convex, of["low"])] * (row == 0)
                    outside = row == high // 2 - 1
                    faces["tread"] += [(convex, of["high"])] * bool(outside and self.belted[j + 1])
                    faces["rim"] += [(convex, of["start"])] * (j == 0)
                    faces["rim"] += [(convex, of["end"])] * (j == wide - 3)
                    for k, name in enumerate(LINES[1:4], start=1):
                        there = name == "ply" or self.belted[j + 1]
                        faces[name] += [(convex, of["high"])] * bool(
                            row == self.edges[k] - 1 and there
                        )
        self.regions = {}
        for number, (name, own) in enumerate(faces.items(), start=1):
            mesh.set_region(number, np.array(own).T)
            self.regions[name] = number

    def _faces(self, convex: int, pts: np.ndarray) -> dict[str, int]:
        """Numbers of a brick's faces, by the nodes that they have."""
        name = {}
        for face in range(6):
            own = self.mesh.pid_in_faces(np.array([[convex], [face]]))
            points = self.mesh.pts(own)
            same = {int(k) for p in points.T for k in np.flatnonzero(abs(pts.T - p).max(1) < 1e-12)}
            name[frozenset(same)] = face
        places = np.rint(2 * gf.GeoTrans("GT_Q2_INCOMPLETE(3)").pts()).astype(int)
        where = lambda axis, value: frozenset(map(int, np.flatnonzero(places[axis] == value)))
        return {
            "start": name[where(0, 0)],
            "end": name[where(0, 2)],
            "low": name[where(1, 0)],
            "high": name[where(1, 2)],
        }

    def _model(self) -> None:
        p, mesh = self.problem, self.mesh
        self.mfu = gf.MeshFem(mesh, 3)
        self.mfu.set_fem(gf.Fem("FEM_Q2_INCOMPLETE(3)"))
        self.full = gf.MeshIm(mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(3,5)"))
        reduced = gf.MeshIm(mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(3,3)"))
        fine = f"IM_STRUCTURED_COMPOSITE(IM_GAUSS_PARALLELEPIPED(3,3),{p['contact_cells']})"
        self.fine = gf.MeshIm(mesh, gf.Integ(fine))
        self.md = md = gf.Model("real")
        md.add_fem_variable("u", self.mfu)
        numbers = {
            "C10": p["C10"],
            "D1": p["D1"],
            "p": p["pressure"],
            "help": 0.0,
            "k": p["road"],
            "H": 1.0,
        }
        for name, value in numbers.items():
            md.add_initialized_data(name, [value])
        stretch = f"pow(Det({F}),-2/3)*Norm_sqr({F})"
        md.add_nonlinear_term(self.full, f"C10*({stretch}-3)")
        md.add_nonlinear_term(reduced, f"sqr(Det({F})-1)/D1")
        # slack cords do not bear yet: a stiffness that is taken away again
        md.add_nonlinear_term(reduced, "help*Grad_u:Grad_Test_u")
        md.add_nonlinear_term(self.full, f"p*({DEFORMED}).Test_u", self.regions["inner"])
        for name, cord in p["cords"].items():
            c, s = np.cos(np.radians(cord["angle_deg"])), np.sin(np.radians(cord["angle_deg"]))
            along = f"({c!r}*{MERIDIAN}+{s!r}*{CIRCLE})"
            stiff = cord["modulus"] * cord["area"] / cord["spacing"]
            energy = f"{stiff / 2!r}*sqr(log(Norm({F}*{along})))"
            md.add_nonlinear_term(self.full, energy, self.regions[name])
        push = "k*pos_part(X(1)+u(1)-H)*Test_u(1)"
        md.add_nonlinear_term(self.fine, push, self.regions["tread"])
        md.add_Dirichlet_condition_with_simplification("u", self.regions["rim"])

    def newton(self, most: int = 25) -> int:
        """Newton's method to 1e-8 of the first residual of its kind; halves steps that make the
        residual grow much."""
        md, reached = self.md, 0
        md.assembly("build_all")
        residual = md.rhs()
        size = np.linalg.norm(residual)
        while size > 1e-2:  # N; forces are of 1e3
            if reached == most:
                raise RuntimeError(f"no equilibrium: {size:g} N are left")
            reached += 1
            started = time.time()
            step = gf.linsolve_mumps(md.tangent_matrix(), residual).ravel()
            base, length = md.variable("u"), 1.0
            while True:
                md.set_variable("u", base + length * step)
                md.assembly("build_rhs")
                residual = md.rhs()
                now = np.linalg.norm(residual)
                if np.isfinite(now) and (now < 2 * size or length < 0.1):
                    break
                length /= 2
            print(
                f"  {size:.3e} -> {now:.3e} N, {length:g}, {time.time() - started:.1f} s",
                flush=True,
            )
            size = now
            md.assembly("build_all")
            residual = md.rhs()
        return reached

    def assembled(self, order: int, im: gf.MeshIm, expression: str, region: str | None) -> Any:
        """A number, vector or matrix of an expression in which w is the displacement, u a small
        one; GetFEM derives no step, so that w must be none of the model's variables."""
        u = self.md.variable("u")
        data = ("u", 1, self.mfu, 0 * u, "w", 0, self.mfu, u, "k", 0, self.md.variable("k"))
        data += ("H", 0, self.md.variable("H"))
        return gf.asm_generic(im, order, expression, self.regions[region] if region else -1, *data)

    def on_tread(self, expression: str) -> float:
        """Integral over the tread, on the points of the contact."""
        return float(self.assembled(0, self.fine, expression, "tread"))

    def crown_radius(self) -> float:
        """The largest x of the deformed nodes at the angle 0."""
        dofs = self.mfu.basic_dof_nodes()
        return float((dofs[0] + self.md.variable("u"))[::3].max())

    def matrix(self, im: gf.MeshIm, expression: str, region: str | None = None) -> csc_matrix:
        """A bilinear form."""
        return as_csc(self.assembled(2, im, expression, region))


def as_csc(matrix: gf.Spmat) -> csc_matrix:
    """A matrix of GetFEM's."""
    columns, rows = matrix.csc_ind()
    return csc_matrix((matrix.csc_val(), rows, columns), shape=matrix.size())


def main() -> None:
    problem = json.loads(Path(sys.argv[1]).read_text())
    started = time.time()
    tyre = Tyre(problem)
    md = tyre.md
    print(
        f"{tyre.mesh.nbcvs()} bricks, {tyre.mfu.nbdof()} equations, {time.time() - started:.0f} s",
        flush=True,
    )
    for modulus in problem["help_Pa"]:
        md.set_variable("help", [modulus])
        print(f"with {modulus:g} Pa of help: {tyre.newton()} iterations", flush=True)
    free = tyre.crown_radius()
    result = {"equations": tyre.mfu.nbdof(), "free_radius_m": free, "loads": []}
    before = 0.0
    for deflection in problem["deflections_m"]:
        for share in np.linspace(0, 1, problem["steps"] + 1)[1:]:
            md.set_variable("H", [free - before - share * (deflection - before)])
            print(
                f"{1e3 * (free - md.variable('H')[0]):.3f} mm: {tyre.newton()} iterations",
                flush=True,
            )
        before = deflection
        result["loads"].append({"deflection_m": deflection, **pressed(tyre, problem)})
        result["seconds"] = time.time() - started
        Path(sys.argv[2]).write_text(json.dumps(result, indent=1) + "\n")
        print(json.dumps(result["loads"][-1]), flush=True)


def pressed(tyre: Tyre, problem: dict) -> dict:
    """Force, area and tangent stiffness, and the lowest modes with the patch sliding and stuck."""
    md = tyre.md
    force = tyre.on_tread("k*pos_part(X(1)+w(1)-H)")
    area = tyre.on_tread(f"{TOUCHES}*Norm({DEFORMED.replace('Grad_u', 'Grad_w')})")
    # K du = -(d residual / d H) dH; the force's change has its own share of dH
    by_height = np.ravel(tyre.assembled(1, tyre.fine, f"-k*{TOUCHES}*Test_u(1)", "tread"))
    free = np.ones(tyre.mfu.nbdof(), bool)
    free[tyre.mfu.basic_dof_on_region(tyre.regions["rim"])] = False
    follows = gf.linsolve_mumps(md.tangent_matrix(), np.where(free, -by_height, 0.0)).ravel()
    stiffness = tyre.on_tread(f"k*{TOUCHES}") + float(by_height @ follows)
    result = {"force_N": force, "area_m2": area, "stiffness_N_per_m": stiffness}
    if problem["modes"]:
        result["sliding_Hz"] = modes(tyre, free, False)
        result["stuck_Hz"] = modes(tyre, free, True)
    return result


def modes(tyre: Tyre, free: np.ndarray, stuck: bool) -> list[float]:
    """The lowest frequencies, the patch held along its normal or wholly."""
    p = tyre.problem
    stiff = as_csc(tyre.md.tangent_matrix())
    if stuck:
        along = f"k*{TOUCHES}*(Test_u(2)*Test2_u(2)+Test_u(3)*Test2_u(3))"
        stiff = stiff + tyre.matrix(tyre.fine, along, "tread")
    mass = p["density"] * tyre.matrix(tyre.full, "Test_u.Test2_u")
    for name, cord in p["cords"].items():
        per_area = cord["density"] * cord["area"] / cord["spacing"]
        mass = mass + per_area * tyre.matrix(tyre.full, "Test_u.Test2_u", name)
    keep = np.flatnonzero(free)
    stiff, mass = (m[keep][:, keep].tocsc() for m in (stiff, mass))
    stiff = (stiff + stiff.T) / 2  # the pressure's part is symmetric where its ends are held
    factor = splu(stiff, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    inverse = LinearOperator(stiff.shape, factor.solve)
    values = eigsh(stiff, p["modes"], mass, sigma=0.0, OPinv=inverse, return_eigenvectors=False)
    return [float(f) for f in np.sort(np.sqrt(values)) / (2 * np.pi)]


if __name__ == "__main__":
    main()
