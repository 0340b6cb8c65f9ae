"""Compliant dexterous pregrasps under shape uncertainty, planned as one nonlinear program.

>>> import sgnlp
>>> plan = sgnlp.solve(sgnlp.load("problems/mug_0.npz"))
>>> plan.best.grasp.gains  # (m,) [N/m]
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__version__ = "0.1.0"
