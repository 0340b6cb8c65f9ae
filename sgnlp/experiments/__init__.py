"""Studies, comparisons of solvers and benchmarks, and the commands that run them.

Problems come in; rows, tables and figures go out. It knows all other rooms, and none knows it: a command is imported by
its name when it is called.
"""
