"""Whether this installation works: packages, solvers, machine, record, and a known tyre."""
