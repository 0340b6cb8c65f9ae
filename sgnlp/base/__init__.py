"""What every other room needs: errors, settings and presets, locks, child processes, the compiler, colours.

Nothing comes in but the user's flags and files; checked settings and plain helpers go out. It knows no other room.
"""
