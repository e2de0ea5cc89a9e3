"""The quasi-static drive, the same for every solver: what is run, the loop, and its result."""
