"""Code that is written for readers, in the README and in pages, made cheap: few points, one start, coarse pieces."""

from dataclasses import replace
from functools import partial, wraps
from importlib.util import find_spec

import pytest
from plans import SMALL_FLAGS
from scenes import SMALL

import sgnlp
from sgnlp.base.presets import ROBUST
from sgnlp.base.settings import Settings
from sgnlp.planning.batch import Task
from sgnlp.simulation.judge import DEFAULTS

CHEAP = [*SMALL_FLAGS[:4], "--contact.samples", str(SMALL.contact.samples), "--solver.formulation", "constrained"]
CHEAP += ["--starts", "1", "--rounds", "1", "--jobs", "1", "--timeout", "3600"]
"""What makes a command cheap that plans."""
BRIEF = {"hold_time": 0.3, "push_time": 0.2}
"""Settings that make a simulation brief."""
COARSE = {"threshold": 0.01, "mcts_iterations": 5, "mcts_max_depth": 1, "resolution": 300}
"""CoACD's search for the pieces of a body, up to a centimetre, in a thirtieth of the time."""


def cheap(settings: Settings) -> Settings:
    """The same settings with the cloud of `CHEAP`, its samples, and one program in the place of two."""
    few = {name: getattr(SMALL.gpis, name) for name in ("surface_points", "interior_points")}
    solver = settings.solver
    if solver.formulation == ROBUST.solver.formulation:
        solver = replace(solver, formulation="constrained")
    return replace(
        settings,
        gpis=replace(settings.gpis, **few),
        contact=replace(settings.contact, samples=SMALL.contact.samples),
        solver=solver,
    )


def plans_are_cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    """`sgnlp.solve` plans from one start, with cheap settings, and so does a task of a batch by default."""
    true = sgnlp.solve

    @wraps(true)
    def solve(observation, hand="allegro_left", settings=ROBUST, **options):
        return true(observation, hand, cheap(settings), **options | {"count": 1, "jobs": 1, "rounds": 1})

    monkeypatch.setattr(sgnlp, "solve", solve)
    monkeypatch.setattr("sgnlp.planning.batch.Task", partial(Task, settings=cheap(ROBUST)))


def simulations_are_brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """`sgnlp.simulate` holds and pushes the object for a moment, whatever its settings."""
    true = sgnlp.simulate

    @wraps(true)
    def simulate(solution, observation, settings=DEFAULTS):
        return true(solution, observation, replace(settings, **BRIEF))

    monkeypatch.setattr(sgnlp, "simulate", simulate)


def pieces_are_coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies are taken apart by a short search."""
    if find_spec("coacd"):
        import coacd

        true = coacd.run_coacd
        monkeypatch.setattr(coacd, "run_coacd", lambda mesh, **options: true(mesh, **options | COARSE))
