"""The bundled tyre solver: reads ABAQUS-keyword decks of an axisymmetric tyre with twist,
inflates it, and extracts the modes of the revolved tyre harmonic by harmonic.

Its rooms, each of which imports only from those before it:

    deck       keywords, what of them is honoured, steps, the request beside a deck
    section    mesh, materials, supports, loads, inflation; in `section.parts` rubber, cords, ...
    modes      of the inflated tyre that is the same all round: harmonics, wheel, cavity, slopes
    solid3d    the section revolved on elements round the circumference
    nonuniform what couples harmonics: masses and springs, a splice, turning
    road       contact, footprints, modes of the pressed tyre
    (here)     a frequency step, a job, its results, the adapter
"""

VERSION = "1.0.0"
