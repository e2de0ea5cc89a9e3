"""The solvers: algorithms that take a chain from one state of rest to the next."""

import lazy_loader

# imported when first used: whoever asks for no solver does not wait for the compiler
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
