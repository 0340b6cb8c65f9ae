"""The hand as MuJoCo has it: its meshes are those that it is shown with, whatever their format, scale and path."""

from pathlib import Path

import numpy as np
import pytest
from descriptions import described, mjcf, urdf
from hands import THREE, changed

from sgnlp.hand.hand import load_hand
from sgnlp.hand.meshes import link_meshes
from sgnlp.simulation.settings import SimulationSettings

mujoco = pytest.importorskip("mujoco")
trimesh = pytest.importorskip("trimesh")
from sgnlp.simulation.articulation import LEAST_MASS, TIP_SCALE, articulation  # noqa: E402

HALF = np.array([0.004, 0.006, 0.009])


def solid(unit: float = 1.0):
    """A tetrahedron-like solid without symmetry, with a long side towards +y [m times unit]."""
    corners = np.array([[-1, -1, -1], [1, -1, -1], [0, 2, -1], [0, 0, 1]]) * HALF * unit
    return trimesh.Trimesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], process=False)


def dressed(target: Path, file: str, scale: str = "") -> Path:
    """The made-up hand with a mesh on the tip of finger a and another on its base."""
    shown = f'<visual><geometry><mesh filename="{file}"{scale}/></geometry></visual>'
    links = [(f'<link name="{link}"/>', f'<link name="{link}">{shown}</link>') for link in ("a_tip", "b_tip", "base")]
    return changed(target, "hand.urdf", *links)


def simulated(folder: Path) -> dict[str, np.ndarray]:
    """The vertices of each link's mesh in the link's frame, sorted."""
    model = articulation(load_hand(folder), SimulationSettings()).compile()
    found = {}
    for geom in range(model.ngeom):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            first = model.mesh_vertadr[mesh]
            corners = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float)
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
            corners = corners @ turn.reshape(3, 3).T + model.geom_pos[geom]
            found[model.body(model.geom_bodyid[geom]).name] = corners[np.lexsort(corners.round(6).T)]
    return found


@pytest.mark.parametrize(
    ("file", "unit", "scale", "signs"),
    [
        ("tip.stl", 1, "", 1),
        ("tip.stl", 1000, ' scale="0.001 0.001 0.001"', 1),
        ("tip.stl", 1, ' scale="1 -1 1"', [1, -1, 1]),
        ("tip.obj", 1000, ' scale="0.001 -0.001 0.001"', [1, -1, 1]),
        ("tip.ply", 1, "", 1),
        ("package://hand/tip.off", 1, "", 1),
    ],
)
def test_a_tips_mesh_is_drawn_back_from_the_size_that_the_urdf_gives_it(tmp_path: Path, file, unit, scale, signs):
    folder = dressed(tmp_path, file, scale)
    solid(unit).export(folder / file.rpartition("/")[2])
    expected = solid().vertices * signs
    expected = expected[np.lexsort(expected.round(6).T)]
    found = simulated(folder)
    np.testing.assert_allclose(found["base"], expected, atol=1e-7)
    for tip in ("a_tip", "b_tip"):
        np.testing.assert_allclose(found[tip], TIP_SCALE * expected, atol=1e-7)
    assert link_meshes(load_hand(folder))[0][0].volume > 0


def test_the_path_of_the_hand_may_be_relative(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    folder = dressed(tmp_path, "package://hand/tip.stl")
    solid().export(folder / "tip.stl")
    monkeypatch.chdir(folder)
    assert set(simulated(Path())) == {"base", "a_tip", "b_tip"}


def test_a_link_that_shows_nothing_is_its_collision_geometry(tmp_path: Path):
    ball = '<collision><geometry><sphere radius="0.01"/></geometry></collision>'
    gone = '<collision><geometry><mesh filename="gone.stl"/></geometry></collision>'
    shown = '<visual><geometry><sphere radius="0.02"/></geometry></visual>'
    hand = load_hand(
        changed(
            tmp_path,
            "hand.urdf",
            ('<link name="base"/>', f'<link name="base">{ball}</link>'),
            ('<link name="a_link"/>', f'<link name="a_link">{shown}{gone}</link>'),
        )
    )
    model = articulation(hand, SimulationSettings()).compile()
    sizes = {model.body(model.geom_bodyid[g]).name: float(model.geom_size[g][0]) for g in range(model.ngeom)}
    assert (sizes["base"], sizes["a_link"]) == (0.01, 0.02)
    assert len(link_meshes(hand)[0]) == 2


def weights(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """The masses of the simulated links (L,) and their centres at the reference posture (L, 3), in the root's frame."""
    hand = load_hand(folder)
    model = articulation(hand, SimulationSettings()).compile()
    data = mujoco.MjData(model)
    for name, value in zip(hand.moving_joints, hand.moving_angles(hand.reference), strict=True):
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return model.body_mass[1:].copy(), data.xipos[1:].copy()


def test_a_hand_of_an_mjcf_weighs_what_the_same_hand_of_a_urdf_does(tmp_path: Path):
    folders = [tmp_path / "mjcf", tmp_path / "urdf"]
    for folder in folders:
        folder.mkdir()
    ours, theirs = weights(described(mjcf(folders[0]))), weights(described(urdf(folders[1])))
    np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-12)
    np.testing.assert_allclose(ours[1], theirs[1], atol=1e-9)
    massless = 2  # the links between the two joints of one body, and before its fixed one
    assert ours[0].sum() == pytest.approx(0.3 + 0.03 + 0.01 + 0.002 + 0.02 + 0.04 + massless * LEAST_MASS)


@pytest.mark.parametrize("file", ["tip.stl", "tip.obj"])
def test_a_mirrored_hand_is_solid_in_the_mirror(tmp_path: Path, file: str):
    folders = [dressed(tmp_path / name, file) for name in ("one", "other")]
    for folder in folders:
        solid().export(folder / file)
    changed(tmp_path / "other", "hand.yaml", ("gains:", "mirror: true\ngains:"))
    one, other = (simulated(folder) for folder in folders)
    for link, corners in one.items():
        image = corners * [1, -1, 1]
        np.testing.assert_allclose(other[link], image[np.lexsort(image.round(6).T)], atol=1e-7)
    assert all(mesh.volume > 0 for mesh in link_meshes(load_hand(folders[1]))[0])
    (masses, centres), (mirrored, images) = (weights(folder) for folder in folders)
    np.testing.assert_allclose(mirrored, masses, rtol=1e-6)
    np.testing.assert_allclose(images, centres * [1, -1, 1], atol=1e-6)


def test_a_root_link_may_be_named_world(tmp_path: Path):
    folder = changed(
        tmp_path, "hand.yaml", *[("base", "world")] * (THREE / "hand.yaml").read_text("utf-8").count("base")
    )
    text = (folder / "hand.urdf").read_text(encoding="utf-8").replace('"base"', '"world"')
    (folder / "hand.urdf").write_text(text, encoding="utf-8")
    model = articulation(load_hand(folder), SimulationSettings()).compile()
    assert model.nbody == 1 + 10  # MuJoCo's own, and the ten links
