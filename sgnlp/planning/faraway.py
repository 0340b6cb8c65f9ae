"""Clouds far from the origin are planned near it: large coordinates leave few digits to differences and products.

The origin of the planning frame is the whole metre nearest to the cloud, so that moving there and back costs only one
rounding of the world's coordinates. A cloud within `NEAR` is planned where it is.
"""

from dataclasses import replace

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand
from sgnlp.perception.observation import Observation
from sgnlp.planning.problem import Problem
from sgnlp.planning.solution import Solution

NEAR = 10.0
"""Within this distance of the origin [m] a double has steps of at most 2e-15 m, which never matter."""


def origin(observation: Observation) -> Array:
    """Origin (3,) [m] of the planning frame in the world: whole metres, 0 for a cloud near the world's."""
    middle = (observation.points.min(axis=0) + observation.points.max(axis=0)) / 2
    return np.round(middle) if np.abs(middle).max() > NEAR else np.zeros(3)


def moved_cloud(observation: Observation, by: Array) -> Observation:
    """The same cloud, table, cameras, background, obstacles and true surface, moved by (3,) [m]."""
    if not by.any():
        return observation
    cameras, background, mesh = observation.camera_positions, observation.background, observation.mesh_vertices
    obstacles = observation.obstacle_points
    return replace(
        observation,
        points=observation.points + by,
        table_height=observation.table_height + float(by[2]),
        camera_positions=None if cameras is None else cameras + by,
        background=None if background is None else background + by,
        mesh_vertices=None if mesh is None else mesh + by,
        obstacle_points=None if obstacles is None else obstacles + by,
    )


def moved_hand(hand: Hand, by: Array) -> Hand:
    """The same hand, its arm's base moved by (3,) [m]."""
    if hand.arm is None or not by.any():
        return hand
    return replace(hand, arm=replace(hand.arm, base=hand.arm.base + np.concatenate([by, np.zeros(4)])))


def moved_problem(problem: Problem, by: Array) -> Problem:
    """The same problem, moved by (3,) [m]."""
    if not by.any():
        return problem
    gpis = replace(problem.gpis, X=problem.gpis.X + by, centre=problem.gpis.centre + by)
    height = problem.table_height + float(by[2])
    around, thing = problem.surroundings.moved(by), problem.thing.moved(by)
    box, com = problem.box + by, problem.com + by
    hand = moved_hand(problem.hand, by)
    return replace(
        problem, hand=hand, gpis=gpis, box=box, table_height=height, com=com, thing=thing, surroundings=around
    )


def moved_solution(s: Solution, by: Array) -> Solution:
    """The same solution, moved by (3,) [m]: x' = R (x - by) + t + by at equilibrium."""
    places = (
        "wrist_position",
        "centre",
        "tips",
        "targets",
        "contacts",
        "contacts_eq",
        "contacts_desired",
        "spheres",
        "spheres_contact",
    )
    links = {name: place + by for name, place in s.grasp.links.items()}
    return replace(
        s,
        wrist=s.wrist + np.concatenate([by, np.zeros(4)]),
        grasp=replace(s.grasp, links=links, **{name: getattr(s.grasp, name) + by for name in places}),
        translation_eq=s.translation_eq + by - s.grasp.rotation @ by,
        contact_points=s.contact_points + by,
    )
