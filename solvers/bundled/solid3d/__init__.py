"""The tyre in three dimensions, its section revolved on elements round the circumference."""
