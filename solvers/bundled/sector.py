"""A tyre one sector of which is of other stuff: a splice.

The section's constants at the angle Theta are C + chi(Theta) (C' - C), chi = 1 in the sector, 0
elsewhere, by its Fourier series up to twice the highest harmonic N of the displacements, which is
all that products of two of them see. On 2 N + 1 nodes round the tyre displacements are exact
trigonometric polynomials, and sums over the stations exact integrals.

The state under pressure is found again, because a stiffer sector also takes up other forces; then
Davidson's method from the axisymmetric tyre's modes, with its K per harmonic.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from .circumference import Circumference
from .coupled import split, tell
from .fold import HALF_TURN, mirror_images
from .gmres import gmres
from .half_turns import davidson, part
from .harmonics import HarmonicModes, Vibration
from .inflation import InflationFailed
from .mechanics import Load, mass
from .model import Model
from .revolved import Inverted, Revolved

Array = np.ndarray
NEAR = 2  # harmonics beyond the highest wanted whose modes may lie close to wanted ones
BEYOND = 6  # harmonics of the displacements beyond the highest wanted
TOLERANCE = 1e-9  # out-of-balance force over the rim's
LONGEST = 20  # iterations
LOOSE = 1e-4  # of each step of Newton's method
SAME = 1e-9  # of a field's image before and after a half turn


@dataclass(frozen=True)
class Sector:
    """Its width (rad), about Theta = 0, and the section as it is there."""

    width: float
    model: Model

    def share(self, angles: Array, highest: int) -> Array:
        """chi at angles (k,), harmonics up to ``highest``."""
        h = np.arange(1, highest + 1)
        wave = 2 * np.sin(h * self.width / 2) / (np.pi * h)
        return self.width / (2 * np.pi) + np.cos(np.outer(angles, h)) @ wave


def full_circle(highest: int) -> Circumference:
    """Trigonometric polynomials up to a harmonic by their values at 2 N + 1 angles."""
    k, s = 2 * highest + 1, 4 * highest + 1
    angles, stations = _angles(k), _angles(s)
    away = stations[:, None] - angles
    n = np.arange(1, highest + 1)
    N = (1 + 2 * np.cos(away[..., None] * n).sum(-1)) / k
    slope = -2 * (n * np.sin(away[..., None] * n)).sum(-1) / k
    weights = np.full(s, 2 * np.pi / s)
    return Circumference(angles, N, slope, weights, weights @ N, (slice(0, s),))


def blended(model: Model, other: Model, share: Array) -> Model:
    """``model`` with constants per Gauss point and station (p, s); an hourglass stiffness stays."""
    mix = lambda a, b, p: (
        np.broadcast_to(a, p)[:, None]
        + np.outer(np.broadcast_to(b, p) - np.broadcast_to(a, p), share)
    )
    rubbers = []
    for r, o in zip(model.rubbers, other.rubbers, strict=True):
        a, b, p = r.material, o.material, r.solids.weights.size
        pick = lambda name, a=a, b=b, p=p: mix(getattr(a, name), getattr(b, name), p)
        law = replace(a, C10=pick("C10"), C01=pick("C01"), inverse_D1=pick("inverse_D1"))
        rubbers.append(replace(r, material=law))
    cords = [
        replace(c, stiffness=mix(c.stiffness, o.stiffness, c.stiffness.size))
        for c, o in zip(model.cords, other.cords, strict=True)
    ]
    return replace(model, rubbers=rubbers, cords=cords)


class Round:
    """Fields (k, nodes, 3) by their values round the tyre; ``free`` (nodes, 3)."""

    def __init__(self, vibration: Vibration, tyre: Revolved, sector: Sector, highest: int):
        self.vibration, self.tyre, self.highest = vibration, tyre, highest
        self.factors = [vibration.factor(n) for n in range(highest + 1)]
        self.free = vibration.numbering.equation < vibration.numbering.size
        self.shape = len(tyre.around.angles), *self.free.shape
        around = tyre.around
        share = sector.share(_angles(len(around.weights)), 2 * highest)
        self._waves = around.N.T @ ((around.weights * share)[:, None] * around.N)
        self._plain = vibration.mass * (2 * np.pi / len(around.angles))
        self._more = mass(sector.model) - vibration.mass

    def field(self, n: int, shape: Array) -> Array:
        """Re[shape exp(i n Theta)]."""
        turned = np.exp(1j * n * self.tyre.around.angles)[:, None, None] * shape
        return np.asarray(turned.real)

    def wave(self, field: Array, n: int) -> Array:
        """The amplitude (nodes, 3) of harmonic n in a field."""
        return np.asarray(np.fft.rfft(field, axis=0)[n] / len(field) * (2 if n else 1))

    def forces(self, field: Array) -> Array:
        """K~ u, N."""
        return self.tyre.product(field) * self.free

    def inertia(self, field: Array) -> Array:
        """M~ u, kg m."""
        flat = field.swapaxes(0, 1).reshape(self.free.shape[0], -1)
        shape = self.free.shape[0], len(field), 3
        image = (self._plain @ flat).reshape(shape)
        if self._more.nnz and abs(self._more).max():
            image = image + np.einsum(
                "kj,njc->nkc", self._waves, (self._more @ flat).reshape(shape)
            )
        return np.asarray(image.swapaxes(0, 1) * self.free)

    def half_turn(self) -> Callable[[Array], Array] | None:
        """Fields turned, (Theta, Z) -> (-Theta, -Z), where that keeps the tyre, as one field tells:
        its section is its own mirror image, whatever the cords' angles."""
        other, k = mirror_images(self.tyre.model.mesh), len(self.tyre.around.angles)
        if (other < 0).any() or (self.free != self.free[other]).any():
            return None
        back = -np.arange(k) % k
        turned = lambda field: HALF_TURN * field[back][:, other]
        field = np.random.default_rng(0).normal(size=(k, *self.free.shape)) * self.free
        for image in (self.forces, self.inertia):
            straight, round = image(field), turned(image(turned(field)))
            if np.linalg.norm(straight - round) > SAME * np.linalg.norm(straight):
                return None
        return turned

    def response(self, force: Array) -> Array:
        """K^-1 of the plain tyre times forces, harmonic by harmonic."""
        numbering = self.vibration.numbering
        waves = np.fft.rfft(force, axis=0) * len(force) / (2 * np.pi)  # N per radian
        for n, factor in enumerate(self.factors):
            right = numbering.gather(waves[n])
            waves[n] = numbering.spread(factor.solve(right if n else right.real))
        return np.fft.irfft(waves, len(force), axis=0)


def _angles(k: int) -> Array:
    return 2 * np.pi * np.arange(k) / k


def sector_modes(
    vibration: Vibration,
    U: Array,
    loads: list[Load],
    model: Model,
    sector: Sector,
    harmonics: list[int],
    count: int,
    check: Callable[[], None] = lambda: None,
    beyond: int = BEYOND,
) -> list[HarmonicModes]:
    """The ``count`` lowest modes of each harmonic of a tyre with a sector of other stuff.

    U: the plain tyre's state under ``loads``; model: the plain one; ``beyond``: harmonics of the
    displacements above the highest wanted. Raises InflationFailed, Unstable, NotConverged.
    """
    top = max(harmonics) + beyond
    around = full_circle(top)
    share = sector.share(_angles(len(around.weights)), 2 * top)
    tyre = Revolved(blended(model, sector.model, share), loads, around)
    fields = Round(vibration, tyre, sector, top)
    equilibrium(fields, U, check)
    turned = fields.half_turn()
    start: list[list[Array]] = [[], []] if turned else [[]]
    places: dict[tuple[int, int], list[tuple[int, int]]] = {}  # of plain modes among them
    for n in range(min(max(harmonics) + NEAR, top) + 1):
        for k, shape in enumerate(vibration.modes(n, count).shapes):
            pair = [fields.field(n, c * shape) for c in ((1.0, 1j) if n else (1.0,))]
            places[n, k] = []
            for kind, field in _by_kind(pair, turned):
                places[n, k].append((kind, len(start[kind])))
                start[kind].append(field)
    each = len(harmonics) * count  # of a doublet one is kept, one reversed
    doublets = sum((2 if n else 1) * count for n in harmonics)
    wanted = [each + 2] * 2 if turned else [doublets + 2]
    spaces = davidson(fields, start, wanted, turned, check)
    values = np.concatenate([space.values for space in spaces])
    order = np.argsort(values, kind="stable")
    owner = [(kind, j) for kind, space in enumerate(spaces) for j in range(len(space.values))]
    shares = [space.held(len(mine)) ** 2 for space, mine in zip(spaces, start, strict=True)]
    held = {
        key: np.array([sum(shares[kind][i, j] for kind, i in mine if kind == own)
                       for own, j in (owner[o] for o in order)])
        for key, mine in places.items()
    }  # fmt: skip
    told = tell(held, harmonics, count)
    result = []
    for n in harmonics:
        size = np.sqrt(np.pi if n else 2 * np.pi)  # from the whole circle's unit mass
        own = [owner[order[j]] for j in told[n]]
        modes = [spaces[kind].mode(j).reshape(fields.shape) for kind, j in own]
        shapes = np.array([size * fields.wave(mode, n) for mode in modes])
        result.append(split(n, values[order[told[n]]], shapes))
    return result


def _by_kind(
    pair: list[Array], turned: Callable[[Array], Array] | None
) -> Iterator[tuple[int, Array]]:
    """The same modes as fields that the half turn keeps (0) and reverses (1), of a doublet one
    each; without a half turn as they are."""
    if turned is None:
        yield from ((0, field) for field in pair)
        return
    kinds = [max((part(f, turned, kind) for f in pair), key=np.linalg.norm) for kind in (0, 1)]
    sizes = [float(np.linalg.norm(field)) for field in kinds]
    for kind, field in enumerate(kinds):
        if len(pair) > 1 or sizes[kind] == max(sizes):
            yield kind, field


def equilibrium(fields: Round, U: Array, check: Callable[[], None]) -> None:
    """Newton's method from the plain tyre's state. Raises InflationFailed."""
    state = np.repeat(U[None], len(fields.tyre.around.angles), 0)
    shape = state.shape
    product = lambda x: fields.forces(x.reshape(shape)).ravel()
    response = lambda x: fields.response(x.reshape(shape)).ravel()
    scale = 0.0
    for _ in range(LONGEST):
        check()
        try:
            whole = fields.tyre.residual(state)
        except Inverted as error:
            raise InflationFailed(0.0, 0.0, f"with the splice {error}") from None
        force = (whole * fields.free).ravel()
        scale = scale or float(np.linalg.norm(whole))  # of what the rim bears
        if np.linalg.norm(force) <= TOLERANCE * scale:
            return
        step, _, _ = gmres(product, response, -force, LOOSE, LONGEST)
        state = state + step.reshape(shape)
    raise InflationFailed(0.0, 0.0, "Newton's method did not converge with the splice")
