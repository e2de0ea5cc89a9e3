"""The event loop in balls, which proves what it finds."""
