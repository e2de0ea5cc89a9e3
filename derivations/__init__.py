"""Proofs of the paper's equations, from the model's own equations of motion.

``python -m derivations`` checks every statement of the paper and prints its verdict. Each subject
has a module with ``derive(model)``: the lines of its derivation under its assumptions, each proved
or checked where it says so, and the entries of the ledger that rest on them. Nothing here imports
the package: the package is held against these proofs.
"""
