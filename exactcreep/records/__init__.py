"""Temperatures as weather services and loggers write them, read as a drive of the chain."""
