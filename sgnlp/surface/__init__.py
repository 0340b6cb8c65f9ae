"""From an observation to a Gaussian-process implicit surface.

An `Observation` comes in, a `Gpis` goes out: mean, deviation, metric distance and their derivatives at any point, in
NumPy, in C, and as the jets that the program takes. It imports from `base` and `perception`.
"""
