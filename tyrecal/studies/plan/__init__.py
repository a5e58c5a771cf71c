"""A test planned before it is made: what to measure, in which order, and what it can find."""
