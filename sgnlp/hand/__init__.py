"""From a folder with a `hand.yaml` and a URDF to a hand, and with an `arm.yaml` to the arm that carries it.

Files come in. A `Hand` goes out, with its forward kinematics in CasADi and in Pinocchio, and what `sgnlp check-hand`
finds out about it; so does an `Arm`, with its inverse kinematics too. It knows `base` and, for the meshes of its links,
`perception`.
"""
