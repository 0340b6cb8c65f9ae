"""The model of hand, table and object: pads, joints, contacts, and what may touch what."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

pytest.importorskip("mujoco")

from grips import box, faces, grip
from scipy.integrate import quad

from sgnlp.hand.hand import load_hand
from sgnlp.hand.kinematics import frames
from sgnlp.simulation import SimulationSettings
from sgnlp.simulation.protocol import Experiment
from sgnlp.simulation.world import HAND

LEFT = load_hand("allegro_left")
SETTINGS = SimulationSettings(
    friction=0.7, joint_damping=0.2, joint_friction=0.05, joint_armature=2e-3, pad_patch=0.004, push_weights=0.0
)
TOLD = grip(LEFT, *faces(0.06, 0.045))


@pytest.fixture(scope="module")
def run() -> Experiment:
    return Experiment(TOLD, box(), LEFT, SETTINGS)


@pytest.fixture(scope="module")
def model(run):
    return run.world.model


def corners(model, geom: int) -> np.ndarray:
    """Vertices of a geom's mesh in the frame of its body."""
    import mujoco

    mesh, turn = model.geom_dataid[geom], np.zeros(9)
    first = model.mesh_vertadr[mesh]
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    return model.mesh_vert[first : first + model.mesh_vertnum[mesh]] @ turn.reshape(3, 3).T + model.geom_pos[geom]


def test_each_pad_is_the_sphere_of_the_hands_file_and_its_links_own_shape_stands_back_from_it(model):
    for finger in LEFT.fingers:
        pad = model.geom(f"{HAND}pad/{finger.name}")
        (own,) = (g for g in range(model.ngeom) if model.geom_bodyid[g] == pad.bodyid[0] and g != pad.id)
        assert pad.size[0] == finger.radius
        np.testing.assert_allclose(pad.pos, finger.offset)
        assert model.body(pad.bodyid[0]).name == f"{HAND}{finger.frame}"
        reach = np.abs(corners(model, own) - pad.pos).max(axis=0)
        assert (reach < 0.995 * finger.radius).all()
        assert (reach > 0.97 * finger.radius).all()


def test_the_tips_of_the_simulated_hand_are_those_of_the_planned_one(run):
    tips, _ = frames(LEFT, TOLD.wrist, TOLD.joints)
    np.testing.assert_allclose(run.data.site_xpos[run.world.tips], tips, atol=1e-9)


def test_joints_have_the_settings_damping_friction_and_rotor_and_the_hands_effort(model):
    for name, effort in zip(LEFT.joint_names, LEFT.effort, strict=True):
        joint = model.joint(HAND + name)
        found = [joint.damping[0], joint.frictionloss[0], joint.armature[0], *model.jnt_actfrcrange[joint.id]]
        assert found == pytest.approx([0.2, 0.05, 2e-3, -effort, effort])


def test_every_contact_slides_at_the_friction_and_twists_as_a_hertzian_patch_that_slips_everywhere(model):
    a, F = SETTINGS.pad_patch, 4.0

    def ring(r: float) -> float:
        """Twist [N] of the ring at r: μ p(r) r 2π r with Hertz' pressure."""
        return SETTINGS.friction * 1.5 * F / (np.pi * a**2) * np.sqrt(1 - (r / a) ** 2) * r * 2 * np.pi * r

    solid = model.geom_contype > 0
    assert solid.sum() > 20
    np.testing.assert_allclose(model.geom_friction[solid, 0], SETTINGS.friction)
    np.testing.assert_allclose(model.geom_friction[solid, 1] * F, quad(ring, 0, a)[0], rtol=1e-6)
    assert (model.geom_condim[solid] == 4).all()


def test_links_of_a_finger_do_not_touch_each_other_and_those_of_two_fingers_may(model):
    names = [model.body(i).name.removeprefix(HAND) for i in range(model.nbody)]
    excluded = {tuple(sorted((names[s >> 16], names[s & 0xFFFF]))) for s in model.exclude_signature.tolist()}
    expected = set()
    for first in (0, 4, 8, 12):
        links = [f"link_{i}.0" for i in range(first, first + 4)]
        expected |= {tuple(sorted(pair)) for pair in combinations([*links, f"{links[-1]}_tip"], 2)}
        expected |= {tuple(sorted(("palm_link", link))) for link in links[:2]}
    assert excluded == expected


def test_the_table_is_at_its_height():
    raised = replace(box(), vertices=np.add(box().vertices, [0, 0, 0.02]), table_height=0.02)
    wrist = np.add(TOLD.wrist, [0, 0, 0.1, 0, 0, 0, 0])
    run = Experiment(replace(TOLD, wrist=wrist), raised, LEFT, SETTINGS)
    assert run.begin.lowest == pytest.approx(0.02, abs=1e-4)
