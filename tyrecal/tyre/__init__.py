"""What a tyre is: case file, section, mesh, materials, effects, resolved."""
