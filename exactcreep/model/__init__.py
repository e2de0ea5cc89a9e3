"""What is simulated, exactly: the chain, its state, its drive, its disorder, its contacts."""
