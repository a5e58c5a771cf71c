"""How probable the shape of a measured mode is, for each mode of a case; `studies/labelling` weighs
it together with all frequencies.

A measured shape u (k,) has the density of `labels.ln_density`, S being the covariance of the case's
mode on these sensors: of a doublet a plane. One shape in 50 (`SPOILT`), and half of those that the
sensors hardly see, are like no mode: two modes mixed, or noise alone. With S = I, a random shape,

    L = ln(((1 - e) p(u | S) + e p(u | I)) / p(u | I)),    e = SPOILT or 1/2

is the ln of the odds of the mode against a frequency that is no mode of the tyre. Modes that these
sensors cannot distinguish (`labels.groups_alike`) share their mean density, because what differs
there are the errors of the model's shapes. So all modes of a harmonic get the largest of their
errors by the sensors' places: a mode that is small and steep at them is refuted by no clean shape.
"""

from __future__ import annotations

import numpy as np

from .case_modes import CaseModes
from .covariance import label_covariances
from .labels import groups_alike, label_of_column, ln_density
from .sensors import Sensors

Array = np.ndarray
SPOILT = 0.02  # share of shapes that are like no mode


def ln_shape_odds(case: CaseModes, sensors: Sensors, shapes: Array) -> Array:
    """L (n, m) of n real shapes (k, n) for the m modes of a case.

    Raises InputError where a sensor is not on the case's tyre.
    """
    k, highest = len(shapes), max(mode.label.c for mode in case.modes)
    general = {
        label_of_column(c, column): S
        for c, column, S, _ in label_covariances(sensors, highest, case.half_width)
    }
    covariance, noise = [], dict[int, float]()
    for mode in case.modes:
        c, off = mode.label.c, case.noise_by_place(mode, sensors)
        noise[c] = max(off, noise.get(c, 0.0))
    for mode in case.modes:
        # a label without a covariance, such as m = 4, has the mean of its c
        same_c = [S for label, S in general.items() if label.c == mode.label.c]
        S = general[mode.label] if mode.label in general else np.mean(same_c, axis=0)
        off = noise[mode.label.c]
        covariance.append((case.covariance(mode, sensors, S) + off * np.eye(k)) / (1 + off))
    spectra = [np.linalg.eigh(S) for S in covariance]
    by_chance = ln_density(np.ones(k), np.eye(k), shapes)
    odds = np.array([ln_density(*spectrum, shapes) for spectrum in spectra]).T - by_chance[:, None]
    groups = groups_alike(covariance, spectra)
    for row in odds:
        group = groups[int(np.argmax(row))]
        row[group] = np.logaddexp.reduce(row[group]) - np.log(len(group))
    spoilt = np.array([SPOILT if case.is_seen(mode, sensors) else 0.5 for mode in case.modes])
    return np.logaddexp(np.log(1 - spoilt) + odds, np.log(spoilt))
