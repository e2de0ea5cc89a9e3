"""The quasi-static drive, the same for every solver: the experiment, the loop, and its result."""
