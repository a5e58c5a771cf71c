"""Each tyre is solved once: what stands above the solver is tested here."""

from ..solved import solved_once as solved_once
