"""A user's own ABAQUS deck of a tyre's section: read as it stands, written flat for the solvers."""
