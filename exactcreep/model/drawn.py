"""The function that draws each type of result, as ``module:name``, which registers itself here."""

DRAWN: dict[str, str] = {}
"""By the name of the type; `exactcreep` registers its own when it is imported."""
