"""Starts for hands of few joints: the wrist poses at which the closing fingers meet the object and can press it."""
