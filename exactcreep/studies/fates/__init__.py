"""The fate of a chain, computed or proved, and statistics over many starts."""

import lazy_loader

# imported when first used: proofs need the certified solver
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
