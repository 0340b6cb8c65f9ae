"""From a folder with a `hand.yaml` and a URDF to a hand, and with an `arm.yaml` to the arm that carries it.

Files come in. A `Hand` goes out, with its forward kinematics in CasADi and in Pinocchio, and the findings of `sgnlp
check-hand`; and an `Arm`, also with inverse kinematics. It imports from `base` and, for the meshes of links, from
`perception`.
"""
