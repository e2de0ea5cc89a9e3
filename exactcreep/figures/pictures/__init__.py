"""The paper's figures, and pictures beyond them."""
