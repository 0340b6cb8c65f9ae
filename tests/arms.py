"""Made-up arms: copies of one of the package in which something is replaced, and a rail with a short arm."""

from pathlib import Path

URDF = Path(__file__).parents[1] / "urdf"


def changed_arm(target: Path, name: str, *changes: tuple[str, str]) -> Path:
    """A folder with a copy of an arm's file in which the first of each `old` is replaced."""
    folder = target / "my_arm"
    folder.mkdir(exist_ok=True)
    text = (URDF / name / "arm.yaml").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    (folder / "arm.yaml").write_text(text, encoding="utf-8")
    return folder


LIMIT = '<limit lower="-1" upper="1.5" effort="20" velocity="2"/>'
LINK = '<inertial><origin xyz="0.1 0 0"/><mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>'
RAIL = f"""<robot name="rail">
  <link name="post"/> <link name="cart">{LINK}</link> <link name="upper">{LINK}</link> <link name="lower">{LINK}</link>
  <link name="plate">{LINK}</link> <link name="camera">{LINK}</link> <link name="lamp">{LINK}</link>
  <link name="jaw">{LINK}</link> <link name="finger">{LINK}</link>
  <joint name="a_rail" type="prismatic"><parent link="post"/><child link="cart"/><axis xyz="0 0.6 0.8"/>{LIMIT}</joint>
  <joint name="b_turn" type="revolute"><parent link="cart"/><child link="upper"/>
    <origin xyz="0 0 0.1" rpy="0.2 0 0"/><axis xyz="0 0.6 0.8"/>{LIMIT}</joint>
  <joint name="c_bend" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>{LIMIT}</joint>
  <joint name="d_end" type="fixed"><parent link="lower"/><child link="plate"/>
    <origin xyz="0.25 0 0" rpy="0 1 0"/></joint>
  <joint name="e_see" type="fixed"><parent link="upper"/><child link="camera"/><origin xyz="0 0 0.2"/></joint>
  <joint name="f_nod" type="revolute"><parent link="upper"/><child link="lamp"/><axis xyz="1 0 0"/>{LIMIT}</joint>
  <joint name="g_hold" type="fixed"><parent link="plate"/><child link="jaw"/></joint>
  <joint name="h_grip" type="prismatic"><parent link="jaw"/><child link="finger"/><axis xyz="1 0 0"/>{LIMIT}</joint>
</robot>
"""
MASS = '<inertial pos="0.1 0 0" mass="2" diaginertia="0.01 0.01 0.01"/>'
RANGE = 'range="-1 1.5" actuatorfrcrange="-20 20"'
RAIL_MJCF = f"""<mujoco model="rail"><compiler angle="radian" eulerseq="XYZ"/><worldbody><body name="post">
  <body name="cart">{MASS}<joint name="a_rail" type="slide" axis="0 0.6 0.8" {RANGE}/>
    <body name="upper" pos="0 0 0.1" euler="0.2 0 0">{MASS}<joint name="b_turn" axis="0 0.6 0.8" {RANGE}/>
      <body name="camera" pos="0 0 0.2">{MASS}</body>
      <body name="lower" pos="0.3 0 0">{MASS}<joint name="c_bend" axis="0 1 0" {RANGE}/>
        <body name="plate" pos="0.25 0 0" euler="0 1 0">{MASS}</body>
</body></body></body></body></worldbody></mujoco>"""
"""The way of the rail to its plate, as an MJCF."""
RAIL_FILE = """name: rail
urdf: arm.urdf
root: post
flange: plate
home: {a_rail: 0.1, b_turn: 0.2, c_bend: -0.3}
base: {position: [0.1, 0.2, 0.3], euler_deg: [10, 20, 30]}
mount: {position: [0.01, 0.02, 0.05], euler_deg: [0, 0, 90]}
spheres:
  post: {link: post, centre: [0, 0, 0], radius: 0.03}
  elbow: {link: lower, centre: [0.01, 0, 0], radius: 0.04}
  plate: {link: plate, centre: [0, 0, 0.02], radius: 0.03}
pairs: [[post, plate]]
"""


def rail(target: Path, *changes: tuple[str, str]) -> Path:
    """An arm of three joints on a slanted rail, with a camera, a lamp that nods and a gripper on its plate."""
    folder = target / "rail"
    folder.mkdir(exist_ok=True)
    texts = {"arm.urdf": RAIL, "arm.yaml": RAIL_FILE}
    for old, new in changes:
        assert any(old in text for text in texts.values()), old
        texts = {name: text.replace(old, new, 1) for name, text in texts.items()}
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder
