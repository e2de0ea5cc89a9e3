"""Pictures and their tables: how a run, a sweep, a comparison is drawn."""
