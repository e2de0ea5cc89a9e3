"""Exact event-driven creep of a chain of sliders with Coulomb friction on an incline."""

__version__ = "0.1.0"
