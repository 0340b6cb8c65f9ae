"""A hand's file drafted from its description: every key that can be guessed is, with the measure that it came from.

Each module guesses one thing from the tree of joints and the meshes of the links; `draft` puts them together.
"""
