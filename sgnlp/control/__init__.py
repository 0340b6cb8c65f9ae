"""The controller that carries out a plan, in Python and, for a robot without it, in C++.

A hand and a `Command`, the grasp in the form that a robot needs, come in; joint torques go out, cycle by cycle. The
simulation runs the same code. `export` writes the file for the header `controller.hpp`. It imports from `base` and
`hand`.

>>> controller = Controller(hand, command(grasps))
>>> controller.torques(time, wrist, joints, speeds)
"""

from sgnlp.control.command import Command, command
from sgnlp.control.controller import Controller
from sgnlp.control.export import export, include
from sgnlp.control.law import WEIGHTLESS, Law

__all__ = ["WEIGHTLESS", "Command", "Controller", "Law", "command", "export", "include"]
