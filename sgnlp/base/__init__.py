"""The base of all other rooms: errors, settings and presets, locks, child processes, compilers, colours.

The user's flags and files come in; checked settings and plain helpers go out. It imports from no other room.
"""
