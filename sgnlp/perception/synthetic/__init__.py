"""Simulated observations: meshes come in, resting poses and the clouds of simulated depth cameras go out."""
