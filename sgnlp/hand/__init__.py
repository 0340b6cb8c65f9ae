"""From a folder with a `hand.yaml` and a URDF to a hand.

Files come in. A `Hand` goes out, with its forward kinematics in CasADi and in Pinocchio, and what `sgnlp check-hand`
finds out about it. It knows `base` and, for the meshes of its links, `perception`.
"""
