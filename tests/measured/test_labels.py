"""Labels of measured shapes: right over random layouts, as sure as they say, refused where the
sensors do not determine them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tyrecal.measured.covariance import half_widths, label_covariances
from tyrecal.measured.labels import Judged, Labeller
from tyrecal.measured.modal import LabelledMode, _labelled, label_in_turn, without_overtones
from tyrecal.measured.sensors import MeasuredMode, Sensors, real_part
from tyrecal.simulate.modes.label import Label

from ..chance import Chance, generator
from .tyres import HIGHEST, layout, measured, modes, noted, shape_of

pytestmark = pytest.mark.numbers

MIN_LABEL_PROBABILITY = 0.9  # a label is told from this probability on
SAME_PARITY, OTHER_PARITY, SIDEWALL = 0.08, 0.01, 0.5  # mean squares, of the label's own


def ring(count: int, across: tuple[float, ...] = (0.0,), directions: str = "rtz") -> Sensors:
    """Evenly spaced sensors on rings of the tread."""
    rows = [
        (0.39 - 0.8 * z * z, 2 * np.pi * a / count, z, "rtz".index(k))
        for z in across
        for a in range(count)
        for k in directions
    ]
    return Sensors(np.array([row[:3] for row in rows]), np.eye(3)[[row[3] for row in rows]])


def waves(sensors: Sensors, c: int, phase: float = 0.3) -> np.ndarray:
    """A belt that moves in its plane with c waves: w = cos c Theta, v = -sin c Theta / c."""
    turn = c * sensors.points[:, 1] + phase
    u = np.column_stack([np.cos(turn), -np.sin(turn) / c, 0 * turn])
    return np.sum(u * sensors.directions, axis=1)


@pytest.mark.slow
def test_random_layouts_give_the_true_labels(chance: Chance) -> None:
    """Modes on random layouts: a label is given in 24 of 25, a wrong one in 1 of 200 at most.

    False failures: 6e-7.
    """
    for tread, side, noise in ((9, 0, 0.05), (9, 5, 0.05), (12, 6, 0.2)):
        given, wrong = [], []
        for i in range(28):
            mode, rng = modes()[i % 14], chance.random
            sensors, nodes = layout(rng, tread, side)
            shape, _ = real_part(measured(mode, sensors, nodes, rng, noise))
            label = Labeller(noted(sensors, rng), HIGHEST + 2).judge(shape).label
            given.append(label is not None)
            wrong.append(label not in (None, mode.label))
        chance.often(given, 0.96)
        chance.often(wrong, 0.0, 0.005)


def test_sensors_on_a_rim_at_rest_change_nothing(chance: Chance) -> None:
    """The label is the true one in 24 of 25 tyres.

    False failures: 1e-7.
    """
    right = []
    for i in range(28):
        mode, rng = modes()[i % 14], chance.random
        sensors, nodes = layout(rng, 9, 3)
        rim = np.column_stack([[0.215] * 9, np.repeat([0.4, 2.5, 4.6], 3), [0.09] * 9])
        every = Sensors(
            np.vstack([sensors.points, rim]), np.vstack([sensors.directions, *[np.eye(3)] * 3])
        )
        u = measured(mode, sensors, nodes, rng, 0.05)
        still = 0.01 * np.abs(u).max() * rng.standard_normal(9)
        judged = Labeller(every, HIGHEST + 2).judge(real_part(np.concatenate([u, still]))[0])
        right.append(judged.label == mode.label)
    chance.often(right, 0.96)


@pytest.mark.slow
def test_poor_layouts_are_as_sure_as_they_are_right(chance: Chance) -> None:
    """Four sensors on the tread, three on a sidewall, a third of the directions missing: some are
    told, some are not; those told are right in 24 of 25, those in doubt as often as they say, by
    0.15, and those that say less than a half in less than 6 of 10.

    False failures: 4e-7.
    """
    sure, right = [], []
    for i in range(150):
        mode, rng = modes()[i % 14], chance.random
        sensors, nodes = layout(rng, 4, 3, drop=0.35)
        judged = Labeller(noted(sensors, rng), HIGHEST + 2).judge(
            real_part(measured(mode, sensors, nodes, rng, 0.1))[0]
        )
        assert (judged.label is not None) == (judged.confidence >= MIN_LABEL_PROBABILITY)
        sure.append(judged.confidence)
        right.append(next(iter(judged.probabilities)) == mode.label)
    p, hit = np.array(sure), np.array(right)
    chance.often(p >= MIN_LABEL_PROBABILITY, 0.1, 0.9)
    chance.often(hit[p >= MIN_LABEL_PROBABILITY], 0.96)
    middle = (p > 0.5) & (p < MIN_LABEL_PROBABILITY)
    stated = float(np.mean(p[middle]))
    chance.often(hit[middle], stated - 0.15, min(stated + 0.15, 1.0))
    chance.often(hit[p < 0.5], 0.0, 0.6)


@pytest.mark.parametrize("c", [1, 2, 3, 5, 6, 7])
def test_even_spacing_aliases_and_says_so(c: int) -> None:
    sensors = ring(8, across=(-0.06, 0.06))
    judged = Labeller(sensors, 8).judge(waves(sensors, c))
    assert judged.label is None
    assert judged.why.startswith("aliasing: sensors at 8 angles")
    assert f"{min(c, 8 - c)} and {max(c, 8 - c)} waves" in judged.why
    assert judged.probabilities[Label(c, 0)] == pytest.approx(
        judged.probabilities[Label(8 - c, 0)], abs=0.2
    )


@pytest.mark.parametrize("c", [1, 2, 3])
def test_what_cannot_be_in_the_band_aliases_nothing(c: int) -> None:
    sensors = ring(8, across=(-0.06, 0.06))
    judged = Labeller(sensors, 3).judge(waves(sensors, c))
    assert judged.label == Label(c, 0) and judged.confidence > 0.97


@pytest.mark.parametrize("m", range(4))
def test_motions_that_are_not_the_labels_are_small_and_smaller_of_the_other_parity(m: int) -> None:
    """Modes [2,m], on sensors that determine all motions: the variances of the belt's polynomials r
    P_k, theta P_k, z P_k-1, and of the sidewalls' over their height, alike on both sides (even m: r
    and theta; odd m: z) or opposite. Own motions, others of the parity, and those of the other
    parity have mean squares of 1, 0.08 and 0.01 on the sensors."""
    tread = ring(9, across=tuple(np.linspace(-0.09, 0.09, 7)))
    rows = [
        (R, 2 * np.pi * a / 9, z, d)
        for R in (0.24, 0.27, 0.30)
        for z in (-0.1, 0.1)
        for a in range(9)
        for d in range(3)
    ]
    walls = np.array([row[:3] for row in rows])
    sensors = Sensors(
        np.vstack([tread.points, walls]),
        np.vstack([tread.directions, np.eye(3)[[row[3] for row in rows]]]),
    )
    every = {(c, order): S for c, order, S, _ in label_covariances(sensors, 3, half_width=0.09)}
    R, angle, Z = sensors.points.T
    belt = R > 0.35
    motions = [(k, k + (d == 2), d) for d in range(3) for k in range(4) if k + (d == 2) < 4]
    across = np.polynomial.legendre.legvander(np.where(belt, Z, 0) / 0.09, 3) * belt[:, None]
    up = np.polynomial.legendre.legvander((R - 0.24) / (0.39 - 0.24) * 2 - 1, 2) * ~belt[:, None]
    sides = [(j, side, d) for d in range(3) for side in (0, 1) for j in range(3)]
    motion = [across[:, k] * sensors.directions[:, d] for k, _, d in motions]
    motion += [up[:, j] * np.sign(Z) ** side * sensors.directions[:, d] for j, side, d in sides]
    kind = ["own" if k == m else "other" if (k - m) % 2 else "same" for _, k, _ in motions]
    kind += ["other" if (side + m + (d == 2)) % 2 else "own" for _, side, d in sides]
    size = np.array([1.0] * len(motions) + [SIDEWALL] * len(sides))
    square = size * np.mean(np.square(motion), axis=1)
    whole = {each: sum(square[i] for i, k in enumerate(kind) if k == each) for each in set(kind)}
    share = {"own": 1.0, "same": SAME_PARITY, "other": OTHER_PARITY}
    wanted = size * [share[k] / whole[k] for k in kind]
    inverse = np.linalg.pinv(np.transpose(motion) * np.cos(2 * angle)[:, None])
    S = every[2, m]
    variances = np.diag(inverse @ S @ inverse.T)
    assert variances / variances[kind.index("own")] == pytest.approx(
        wanted / wanted[kind.index("own")], rel=0.1
    )


@pytest.mark.slow
def test_layouts_know_beforehand_what_they_cannot_tell() -> None:
    alike = Labeller(ring(8, across=(-0.06, 0.06)), 8).looks_like()
    assert alike[Label(3, 0)][0] == Label(5, 0) and alike[Label(5, 0)][0] == Label(3, 0)
    assert Label(2, 0) not in alike[Label(3, 0)]
    centre = Labeller(ring(17, directions="r"), 6).looks_like()
    assert Label(2, 0) in centre[Label(2, 2)]  # r P0 and r P2 on the middle line
    assert centre[Label(2, 1)]  # it is not seen there
    both = Labeller(ring(17, across=(-0.07, 0.0, 0.07)), 6).looks_like()
    assert not both[Label(2, 0)] and not both[Label(2, 1)]


def test_radial_sensors_on_the_middle_line_say_what_they_lack() -> None:
    sensors = ring(17, directions="r")
    judged = Labeller(sensors, 6).judge(waves(sensors, 2))
    assert judged.label is None
    assert "nothing tangential or axial was measured on the tread" in judged.why


@pytest.mark.parametrize("mode", range(0, 14, 3))
def test_one_sensor_tells_nothing(mode: int) -> None:
    rng = generator(mode)
    sensors, nodes = layout(rng, 1, 0, drop=0.0)
    shape = real_part(measured(modes()[mode], sensors, nodes, rng, 0.01))[0]
    assert Labeller(sensors).judge(shape).label is None


@settings(max_examples=20, deadline=None)
@given(
    size=st.floats(1e-6, 1e6), phase=st.floats(0, 7), turn=st.floats(0, 7), seed=st.integers(0, 99)
)
def test_size_phase_place_of_the_origin_and_sign_of_a_sensor_do_not_matter(
    size: float, phase: float, turn: float, seed: int
) -> None:
    rng = generator(seed)
    sensors, nodes = layout(rng, 6, 3)
    u = measured(modes()[seed % 14], sensors, nodes, rng, 0.05)
    before = Labeller(sensors, 8).judge(real_part(u)[0])
    sign = rng.choice([-1, 1], len(u))
    turned = Sensors(sensors.points + turn * np.eye(3)[1], sensors.directions * sign[:, None])
    after = Labeller(turned, 8).judge(real_part(size * np.exp(1j * phase) * sign * u)[0])
    assert after.probabilities == pytest.approx(before.probabilities, abs=1e-6)


def test_a_travelling_wave_has_no_collinearity_a_standing_one_has_all() -> None:
    angle = 2 * np.pi * np.arange(12) / 12
    assert real_part(np.exp(2j * angle))[1] == pytest.approx(0, abs=1e-12)
    shape, collinearity = real_part(np.cos(2 * angle) * np.exp(0.7j))
    assert collinearity == pytest.approx(1)
    assert np.abs(shape) == pytest.approx(np.abs(np.cos(2 * angle)))


def told(frequency: float, label: Label | None) -> LabelledMode:
    sensors = ring(5)
    judged = Labeller(sensors, 2).judge(waves(sensors, 1))
    judged = type(judged)(label, judged.probabilities)
    return LabelledMode(
        MeasuredMode(frequency, waves(sensors, 1)), sensors, waves(sensors, 1), 1.0, judged, ""
    )


def test_doublets_have_two_members_and_overtones_no_label() -> None:
    axial = Label(0, 0, "axial")
    given = [
        told(66.4, Label(2, 1)),
        told(66.1, Label(2, 1)),
        told(120.0, Label(2, 1)),
        told(30.0, axial),
        told(30.4, axial),
        told(80.0, Label(2, 0)),
        told(85.0, None),
    ]
    rows = [(t.mode.frequency_Hz, t.judged.label, t.member) for t in without_overtones(given)]
    assert rows == [
        (30.0, axial, ""),
        (30.4, None, ""),
        (66.1, Label(2, 1), "1"),
        (66.4, Label(2, 1), "2"),
        (80.0, Label(2, 0), ""),
        (85.0, None, ""),
        (120.0, None, ""),
    ]
    assert "[2,1] is at 66.10 Hz already" in without_overtones(given)[-1].judged.why


def test_another_number_of_waves_holds_a_thousandth() -> None:
    """[2,0] on radial sensors: a wave of c = 3 has a seventh of the mean over c = 0 to 6."""
    sensors = ring(17, directions="r")
    labeller = Labeller(sensors, 6)
    S = labeller.covariance[labeller.labels.index(Label(2, 0))]
    assert np.trace(S) == pytest.approx(17)
    energy = {}
    for c in (2, 3):
        wave = np.cos(c * sensors.points[:, 1])
        energy[c] = wave @ S @ wave
    other = 0.001 / 7
    assert energy[3] / energy[2] == pytest.approx(other / (1 + other), rel=1e-6)


def test_probabilities_are_those_of_normal_signals_of_any_size() -> None:
    """p(u | label) by the formula of the module, over its five sizes of noise."""
    sensors = ring(7, across=(-0.06, 0.06))
    labeller = Labeller(sensors, 4)
    u = waves(sensors, 2) + 0.4 * generator("signals").standard_normal(len(sensors.points))
    k, ln = len(u), []
    for S in labeller.covariance:
        each = []
        for nu in (1e-4, 1e-3, 1e-2, 5e-2, 0.2):
            noisy = S + nu * np.eye(k)
            square = u @ np.linalg.solve(noisy, u)
            each.append(-np.linalg.slogdet(noisy)[1] / 2 - k / 2 * np.log(square))
        ln.append(np.logaddexp.reduce(each))
    bends = [x.m > 1 or x == Label(0, 1) for x in labeller.labels]
    p = np.exp(np.array(ln) - max(ln)) * np.where(bends, 0.02, 1.0)
    p /= p.sum()
    first = int(np.argmax(p))
    whole = [S + 0.02 * np.eye(k) for S in labeller.covariance]
    own = whole[first]
    odds = [
        (np.trace(np.linalg.solve(S, own)) - k) / 2
        + (np.linalg.slogdet(S)[1] - np.linalg.slogdet(own)[1]) / 2
        for S in whole
    ]
    alike = np.array(odds) < 5
    assert [x for x, is_alike in zip(labeller.labels, alike, strict=True) if is_alike] == [
        Label(2, 0),
        Label(2, 2),
    ]
    p[alike] = p[alike].sum() * np.where(bends, 0.02, 1.0)[alike] / 1.02
    by_label = labeller.judge(u).probabilities
    assert by_label == pytest.approx(dict(zip(labeller.labels, p, strict=True)), abs=1e-9)
    assert list(by_label.values())[1] > 1e-6
    above = labeller.judge(u, [Label(2, 0)]).probabilities
    assert above[Label(2, 2)] == above[Label(2, 0)] > 0.4


@pytest.mark.parametrize("size", [1e-40, 1e40])
def test_a_shapes_unit_is_never_too_large_or_too_small(size: float) -> None:
    sensors = ring(9, across=(-0.06, 0.06))
    labeller, u = Labeller(sensors, 4), waves(sensors, 2)
    assert labeller.judge(size * u).probabilities == pytest.approx(labeller.judge(u).probabilities)


def belt_and_walls() -> Sensors:
    """Nine radial sensors on the tread, nine on either sidewall."""
    rows = [
        (R, 2 * np.pi * a / 9, z)
        for R, z in ((0.39, 0.0), (0.3, 0.1), (0.3, -0.1))
        for a in range(9)
    ]
    return Sensors(np.array(rows), np.tile([1.0, 0.0, 0.0], (27, 1)))


def told_of(amplitude: np.ndarray) -> LabelledMode:
    """Labelled mode of a shape about whose label the labeller is sure."""
    sensors = belt_and_walls()
    sure = SimpleNamespace(sensors=sensors, judge=lambda shape, below: Judged(Label(2, 0), {}, ""))
    return _labelled(MeasuredMode(66.0, amplitude), sure, "a.uff")  # type: ignore[arg-type]


def test_a_shape_is_told_with_its_largest_value_1() -> None:
    wave = np.tile(np.cos(2 * np.pi * np.arange(9) * 2 / 9), 3)
    for size in (1e-5, 1.0, 3e4j):
        shape = told_of(size * wave + 0j).shape
        assert abs(shape).max() == pytest.approx(1) and abs(shape[0]) == pytest.approx(1)
        assert abs(shape) == pytest.approx(abs(wave))
    assert not told_of(np.zeros(27, complex)).shape.any()


@pytest.mark.parametrize(("part", "label"), [(0.11, True), (0.09, False)])
def test_a_mode_of_the_sidewalls_has_no_label(part: float, label: bool) -> None:
    """The mean square of the belt's motion is below a tenth of all sensors'."""
    wall = np.sqrt((3 / part - 1) / 2)
    labelled = told_of(np.repeat([1.0, wall, wall], 9) + 0j)
    assert (labelled.judged.label is not None) == label
    assert label or "the belt hardly moves" in labelled.judged.why


@pytest.mark.parametrize(("collinear", "label"), [(0.51, True), (0.49, False)])
def test_a_complex_shape_has_no_label(collinear: float, label: bool) -> None:
    size = np.sqrt((1 - collinear) / (1 + collinear))
    turn = 2 * np.pi * np.arange(9) * 2 / 9
    labelled = told_of(np.tile(np.cos(turn) + 1j * size * np.sin(turn), 3))
    assert labelled.collinearity == pytest.approx(collinear)
    assert (labelled.judged.label is not None) == label
    assert label or "collinearity 0.49" in labelled.judged.why


@pytest.mark.parametrize(("rings", "directions"), [((-0.085, 0.085), "rtz"), ((0.0,), "rtz")])
def test_alike_orders_share_their_probability_and_the_lower_comes_first(
    rings: tuple[float, ...], directions: str
) -> None:
    """Rings where r P0 and r P2 cannot be distinguished: a clean wave alone in a file is [2,0],
    with the prior's odds; clearly above a [2,0] it is either, and gets no label."""
    sensors = ring(16, across=rings, directions=directions)
    labeller = Labeller(sensors, 6)
    u = waves(sensors, 2)
    alone = labeller.judge(u)
    assert alone.label == Label(2, 0)
    assert alone.probabilities[Label(2, 2)] == pytest.approx(0.02 / 1.02, abs=0.002)
    modes = [(MeasuredMode(hertz, u), labeller, "") for hertz in (240.0, 80.0, 80.4)]
    rows = [(t.mode.frequency_Hz, t.judged.label, t.member) for t in label_in_turn(modes)]
    assert rows == [(80.0, Label(2, 0), "1"), (80.4, Label(2, 0), "2"), (240.0, None, "")]


def test_a_belt_is_as_wide_as_known_or_as_tyres_are() -> None:
    sensors = ring(9, across=(-0.05, 0.05))
    widths = half_widths(sensors)
    R = sensors.points[:, 0].max()
    assert widths.min() > 0.18 * R and widths.max() < 0.40 * R
    assert widths.mean() == pytest.approx(0.29 * R)
    assert half_widths(sensors, 0.09) == pytest.approx([0.09])
    assert half_widths(ring(9, across=(0.1,)), 0.09) == pytest.approx([0.1])  # none beyond the belt
    assert half_widths(ring(9, across=(0.1,))).min() > 0.1


@pytest.mark.parametrize("rings", [(-0.95, 0.95), (0.0,), (-0.5, 0.5), (-0.9, 0.0, 0.9)])
def test_usual_rings_of_triaxial_sensors_give_no_wrong_label(rings: tuple[float, ...]) -> None:
    """The tool's own shapes without noise at shares of the tread's half width: where two rings or
    more are on the belt all are right."""
    points = shape_of(modes()[0]).points
    R, Z = points.T
    width = np.abs(Z[0.95 * R.max() < R]).max()
    nodes = [int(np.argmax(R - 5 * abs(Z - z * width))) for z in rings]
    rows = [(i, 2 * np.pi * k / 16, d) for i in nodes for k in range(16) for d in range(3)]
    where = np.array([(R[i], turn, Z[i]) for i, turn, _ in rows])
    sensors = Sensors(where, np.eye(3)[[d for *_, d in rows]])
    at = np.array([i for i, *_ in rows])
    labeller = Labeller(sensors, HIGHEST)
    rng = generator("rings")
    every = [
        (MeasuredMode(mode.frequency_Hz, measured(mode, sensors, at, rng, 0.0)), labeller, "")
        for mode in sorted(modes(), key=lambda mode: mode.frequency_Hz)
    ]
    labels = [t.judged.label for t in label_in_turn(every)]
    true = [mode.label for mode in sorted(modes(), key=lambda mode: mode.frequency_Hz)]
    assert all(label in (None, own) for label, own in zip(labels, true, strict=True))
    assert len(rings) == 1 or labels == true
