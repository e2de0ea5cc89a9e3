"""What a chain does for ever: computed, proved, and over many starts."""
