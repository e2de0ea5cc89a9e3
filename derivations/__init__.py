"""Proofs of the paper's equations, from the model's own equations of motion.

``python -m derivations`` checks every statement of the paper and prints its verdict. Each subject
has a module with ``derive()``, which returns the expressions with the steps that lead to them under
its assumptions, and ``check()``, which proves the identities, or raises. The entries of the ledger
stand in the module of their subject. Nothing here imports the package: the package is held against
these proofs.
"""
