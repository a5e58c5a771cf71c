"""Commands ask the solver for the same few tyres again and again."""

from ..solved import solved_once as solved_once
