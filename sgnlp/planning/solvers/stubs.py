"""Solvers that CasADi knows and its wheel has no library for; they run where there is one.

blockSQP itself is in the wheel, but asks for MA27, which is not.
"""

from sgnlp.planning.solvers.anatomy import Method, Task
from sgnlp.planning.solvers.plugins import Options, plugin

KINDS = {
    "madnlp": "interior point",
    "knitro": "interior point",
    "snopt": "SQP",
    "worhp": "SQP",
    "conopt": "reduced gradient",
    "blocksqp": "SQP",
}


def options(task: Task) -> Options:
    """None: each has its own, and no common ones."""
    return {}


METHODS = tuple(
    Method(
        name=name,
        kind=kind,
        derivatives=1 if name in ("snopt", "blocksqp") else 2,
        summary=f"{name}, with its own defaults",
        known="not in CasADi's wheel" if name != "blocksqp" else "needs MA27",
        prepare=plugin(name, options),
    )
    for name, kind in KINDS.items()
)
