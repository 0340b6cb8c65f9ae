"""From an observation to a plan: ranked grasps, all recomputed from the solver's variables.

An `Observation`, a hand and `Settings` come in; a `Plan` goes out, and the files that hold it. It imports from the
rooms before it: `base`, `perception`, `surface`, `hand`, `program`.
"""
