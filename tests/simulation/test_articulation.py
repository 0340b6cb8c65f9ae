"""The hand as MuJoCo has it: its meshes are those that it is shown with, whatever their format, scale and path."""

from pathlib import Path

import numpy as np
import pytest
from hands import THREE, changed

from sgnlp.hand.hand import load_hand
from sgnlp.hand.meshes import link_meshes
from sgnlp.simulation.settings import SimulationSettings

mujoco = pytest.importorskip("mujoco")
trimesh = pytest.importorskip("trimesh")
from sgnlp.simulation.articulation import TIP_SCALE, articulation  # noqa: E402

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


def test_a_root_link_may_be_named_world(tmp_path: Path):
    folder = changed(
        tmp_path, "hand.yaml", *[("base", "world")] * (THREE / "hand.yaml").read_text("utf-8").count("base")
    )
    text = (folder / "hand.urdf").read_text(encoding="utf-8").replace('"base"', '"world"')
    (folder / "hand.urdf").write_text(text, encoding="utf-8")
    model = articulation(load_hand(folder), SimulationSettings()).compile()
    assert model.nbody == 1 + 10  # MuJoCo's own, and the ten links
