"""A box of 8 cm that stands on the table."""

import numpy as np

from sgnlp.perception.synthetic.meshes import Mesh

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]) - [0.5, 0.5, 0.0]
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
BOX = Mesh(0.08 * CUBE, np.array([[a, b, c] for p, q, r, s in SIDES for a, b, c in ((p, q, r), (p, r, s))]))
