"""The simulated system, exactly: the chain, its state, its drive, its disorder, its contacts."""
