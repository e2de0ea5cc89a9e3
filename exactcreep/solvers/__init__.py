"""The solvers: algorithms that take a chain from one state of rest to the next."""
