"""Studies, comparisons of solvers and benchmarks, and the commands that run them.

Problems come in; rows, tables and figures go out. It imports from all other rooms, and no room imports from it: its
commands are imported by name when they are called.
"""
