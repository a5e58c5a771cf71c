"""The bundled tyre solver: reads ABAQUS-keyword decks of an axisymmetric tyre with twist,
inflates it, and extracts the modes of the revolved tyre harmonic by harmonic."""

VERSION = "1.0.0"
