"""Exit codes of the command line."""

FEASIBLE = 0
"""A feasible grasp was found, or the command did what it was asked."""
NONE_FEASIBLE = 1
"""No start gave a feasible grasp, or the first choice is not as confident as --min-confidence asks; in a batch one of
the objects is so. In a simulation: no grasp held with the full score. In a study: a case failed."""
USAGE = 2
"""The flags are wrong."""
BAD_INPUT = 3
"""A file, name or value is wrong, or a hand that was examined."""
MACHINE = 4
"""The machine ran out of disk, memory, processes or open files. Nothing is left half-written."""
INTERRUPTED = 130
"""Ended by Ctrl-C."""
BROKEN_PIPE = 141
"""The reader of the output has closed the pipe, as `head` does; the shell's code for SIGPIPE."""
