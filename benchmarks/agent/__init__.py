"""An agent's test: thirty questions of drivers and fleet engineers, the tools that answer them, and the facts of a right answer."""
