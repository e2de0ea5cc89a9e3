"""The solver called "verlet": velocity Verlet at a fixed time step, kept independent."""
