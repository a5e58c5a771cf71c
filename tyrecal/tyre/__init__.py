"""Tyre of a case: case file, section, mesh, materials, effects, resolved."""
