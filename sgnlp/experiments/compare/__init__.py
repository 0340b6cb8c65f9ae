"""Solvers compared on the same problems from the same starts, by residuals that are recomputed."""
