"""A made-up hand as an MJCF and as a URDF that says the same, on an arm that is left out."""

from pathlib import Path

PARTS = """<mujoco>
  <default>
    <default class="finger">
      <joint type="hinge" axis="0 1 0" range="-20 80"/>
      <geom type="capsule" size="0.008" group="3"/>
    </default>
  </default>
</mujoco>
"""
"""What the hand's file includes: the defaults of its fingers, with angles in degrees."""
MJCF = """<mujoco model="made_up">
  <compiler angle="degree" eulerseq="XYZ" autolimits="true"/>
  <include file="parts.xml"/>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="apple" pos="1 0 0"><freejoint/><geom size="0.05"/></body>
    <body name="forearm" pos="0 0 0.3" euler="0 30 0">
      <freejoint/>
      <geom type="box" size="0.03 0.03 0.1"/>
      <body name="palm" pos="0 0 0.12" euler="10 0 90">
        <inertial pos="0.01 0.002 0.03" mass="0.3" fullinertia="4e-4 3e-4 2e-4 1e-5 2e-5 3e-5"/>
        <joint name="wrist" axis="1 0 0" range="-30 30"/>
        <geom type="box" size="0.04 0.01 0.05" pos="0 0 0.05" contype="0" conaffinity="0" group="2"/>
        <geom type="box" size="0.05 0.02 0.06" pos="0 0 0.05" group="3"/>
        <body name="knuckle" pos="0.03 0 0.1" euler="5 10 15" childclass="finger">
          <inertial pos="0 0.001 0.02" mass="0.03" fullinertia="1e-5 9e-6 4e-6 1e-6 5e-7 -8e-7"/>
          <joint name="spread" axis="1 0 0" range="-20 20"/>
          <joint name="flex" pos="0 0.002 0.01" ref="5"/>
          <geom fromto="0 0 0 0 0 0.04"/>
          <body name="tip" pos="0 0 0.05">
            <inertial pos="0 0 0.01" mass="0.01" diaginertia="2e-6 2e-6 1e-6"/>
            <joint name="curl"/>
            <geom type="sphere" size="0.009" pos="0 0 0.02"/>
            <body name="nail" pos="0 -0.005 0.02" euler="90 0 0">
              <inertial pos="0 0 0" mass="0.002" diaginertia="1e-7 1e-7 1e-7"/>
              <geom type="ellipsoid" size="0.003 0.006 0.004" euler="20 0 0"/>
            </body>
          </body>
        </body>
        <body name="little" pos="-0.03 0 0.1" childclass="finger">
          <inertial pos="0 0 0.02" mass="0.02" diaginertia="1e-5 9e-6 2e-6"/>
          <joint name="bend"/>
          <geom fromto="0 0 0 0 0 0.04"/>
        </body>
        <body name="thumb" pos="-0.03 0 0.02" euler="0 -40 0" childclass="finger">
          <inertial pos="0 0 0.02" mass="0.04" diaginertia="1e-5 9e-6 2e-6"/>
          <joint name="push" type="slide" axis="0 0.6 0.8" range="-0.01 0.02" ref="0.003"/>
          <geom fromto="0 0 0 0 0 0.04"/>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon><fixed name="both"><joint joint="flex" coef="1"/><joint joint="bend" coef="0.5"/></fixed></tendon>
  <actuator>
    <position name="bends" tendon="both" forcerange="-2 2"/>
    <motor name="spreads" joint="spread" gear="3" ctrlrange="-0.5 0.5"/>
  </actuator>
  <equality><joint joint1="push" joint2="curl" polycoef="0.001 0.01 0 0 0"/></equality>
</mujoco>
"""
FIVE = 0.08726646259971647  # 5 degrees, the zero of `flex`
URDF = f"""<robot name="made_up">
  <link name="palm">
    <inertial><origin xyz="0.01 0.002 0.03"/><mass value="0.3"/>
      <inertia ixx="4e-4" iyy="3e-4" izz="2e-4" ixy="1e-5" ixz="2e-5" iyz="3e-5"/></inertial>
    <visual><origin xyz="0 0 0.05"/><geometry><box size="0.08 0.02 0.1"/></geometry></visual>
  </link>
  <link name="spread_link"/>
  <link name="flex_link"/>
  <link name="knuckle">
    <inertial><origin xyz="0 0.001 0.02"/><mass value="0.03"/>
      <inertia ixx="1e-5" iyy="9e-6" izz="4e-6" ixy="1e-6" ixz="5e-7" iyz="-8e-7"/></inertial>
    <collision><origin xyz="0 0 0.02"/><geometry><capsule radius="0.008" length="0.04"/></geometry></collision>
  </link>
  <link name="tip">
    <inertial><origin xyz="0 0 0.01"/><mass value="0.01"/>
      <inertia ixx="2e-6" iyy="2e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 0.02"/><geometry><sphere radius="0.009"/></geometry></collision>
  </link>
  <link name="nail">
    <inertial><mass value="0.002"/><inertia ixx="1e-7" iyy="1e-7" izz="1e-7" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin rpy="-1.2217304763960306 0 0"/>
      <geometry><cylinder radius="0.004" length="0.004"/></geometry></visual>
    <visual><origin xyz="0 0.001879385241571817 0.0006840402866513374"/>
      <geometry><sphere radius="0.004"/></geometry></visual>
    <visual><origin xyz="0 -0.001879385241571817 -0.0006840402866513374"/>
      <geometry><sphere radius="0.004"/></geometry></visual>
  </link>
  <link name="little">
    <inertial><origin xyz="0 0 0.02"/><mass value="0.02"/>
      <inertia ixx="1e-5" iyy="9e-6" izz="2e-6" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 0.02"/><geometry><capsule radius="0.008" length="0.04"/></geometry></collision>
  </link>
  <link name="thumb">
    <inertial><origin xyz="0 0 0.02"/><mass value="0.04"/>
      <inertia ixx="1e-5" iyy="9e-6" izz="2e-6" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 0.02"/><geometry><capsule radius="0.008" length="0.04"/></geometry></collision>
  </link>
  <joint name="spread" type="revolute"><parent link="palm"/><child link="spread_link"/>
    <origin xyz="0.03 0 0.1" rpy="0.08726646259971647 0.17453292519943295 0.2617993877991494"/><axis xyz="1 0 0"/>
    <limit lower="-0.3490658503988659" upper="0.3490658503988659" effort="1.5" velocity="0"/></joint>
  <joint name="flex" type="revolute"><parent link="spread_link"/><child link="flex_link"/>
    <origin xyz="0 0.002 0.01" rpy="0 {-FIVE} 0"/><axis xyz="0 1 0"/>
    <limit lower="-0.3490658503988659" upper="1.3962634015954636" effort="2" velocity="0"/></joint>
  <joint name="knuckle_fixed" type="fixed"><parent link="flex_link"/><child link="knuckle"/>
    <origin xyz="0 -0.002 -0.01"/></joint>
  <joint name="curl" type="revolute"><parent link="knuckle"/><child link="tip"/><origin xyz="0 0 0.05"/>
    <axis xyz="0 1 0"/><limit lower="-0.3490658503988659" upper="1.3962634015954636" effort="0" velocity="0"/></joint>
  <joint name="nail_fixed" type="fixed"><parent link="tip"/><child link="nail"/>
    <origin xyz="0 -0.005 0.02" rpy="1.5707963267948966 0 0"/></joint>
  <joint name="bend" type="revolute"><parent link="palm"/><child link="little"/><origin xyz="-0.03 0 0.1"/>
    <axis xyz="0 1 0"/><limit lower="-0.3490658503988659" upper="1.3962634015954636" effort="1" velocity="0"/></joint>
  <joint name="push" type="prismatic"><parent link="palm"/><child link="thumb"/>
    <origin xyz="{-0.03 + 0.0024 * 0.6427876096865394} -0.0018 {0.02 - 0.0024 * 0.766044443118978}"
      rpy="0 -0.6981317007977318 0"/>
    <axis xyz="0 0.6 0.8"/><limit lower="-0.01" upper="0.02" effort="0" velocity="0"/>
    <mimic joint="curl" multiplier="0.01" offset="0.004"/></joint>
</robot>
"""
"""The part of it from the palm on. Of the nail's ellipsoid it has the capsule around it on its longest axis."""
HAND = """name: made_up
urdf: {file}
root: palm
effort: 1.0
fingers:
  - {{name: index, tip: tip, offset: [0, 0, 0.02], radius: 0.01}}
  - {{name: little, tip: little, offset: [0, 0, 0.04], radius: 0.01}}
  - {{name: thumb, tip: thumb, offset: [0, 0, 0.04], radius: 0.01}}
reference: {{bend: 0.1, push: 0.005, spread: 0, flex: 0.2}}
gains: {{lower: 20, upper: 300, initial: 100}}
wrist:
  root_euler_deg: [180, 0, 0]
  starts:
    - {{position: [0, 0, 0.2], euler_deg: [0, 0, 0]}}
spheres:
  cover:
    spheres:
      index: {{link: tip, centre: [0, 0, 0.02], radius: 0.01}}
      little: {{link: little, centre: [0, 0, 0.04], radius: 0.01}}
      thumb: {{link: thumb, centre: [0, 0, 0.04], radius: 0.01}}
      palm: {{link: palm, centre: [0, 0, 0.05], radius: 0.06}}
    pads: {{index: index, little: little, thumb: thumb}}
    pairs: [[index, thumb]]
"""
"""The hand's file, for either."""


def described(file: Path) -> Path:
    """The folder of the hand that a file describes, with a hand's file beside it."""
    (file.parent / "hand.yaml").write_text(HAND.format(file=file.name), encoding="utf-8")
    return file.parent


def mjcf(folder: Path, *changes: tuple[str, str]) -> Path:
    """The MJCF in a folder, with the file that it includes, in which the first of each `old` is replaced."""
    text = MJCF
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    (folder / "parts.xml").write_text(PARTS, encoding="utf-8")
    (folder / "made_up.xml").write_text(text, encoding="utf-8")
    return folder / "made_up.xml"


def urdf(folder: Path) -> Path:
    """The URDF in a folder."""
    (folder / "made_up.urdf").write_text(URDF, encoding="utf-8")
    return folder / "made_up.urdf"
