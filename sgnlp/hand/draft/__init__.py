"""Drafts a hand's file from its description: every key that can be guessed, with the measurement behind it.

Each module guesses one thing from the tree of joints and the meshes of the links; `draft` combines them.
"""
