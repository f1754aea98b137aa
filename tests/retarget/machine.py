"""A small machine that is no Humanoid-v5: ankles, flat feet, servos, no floor, no meshes."""

from pathlib import Path

import mujoco

from robojackson.retarget import RobotDescription
from robojackson.retarget.description import ContactPoint

_LEG = """
<body name="{s}_thigh" pos="0 {y} -0.05"><geom size=".03" fromto="0 0 0 0 0 -.25" mass="1"/>
 <joint name="{s}_hip_pitch" axis="0 1 0" range="-2 1"/>
 <joint name="{s}_hip_roll" axis="1 0 0" range="-.6 .6"/>
 <joint name="{s}_hip_yaw" axis="0 0 1" range="-.8 .8"/>
 <body name="{s}_shin" pos="0 0 -.28"><geom size=".025" fromto="0 0 0 0 0 -.22" mass=".6"/>
  <joint name="{s}_knee" axis="0 1 0" range="0 2.4"/>
  <body name="{s}_sole" pos="0 0 -.27"><geom type="box" size=".07 .03 .01" pos=".03 0 -.02"
   mass=".2"/>
   <joint name="{s}_ankle_pitch" axis="0 1 0" range="-.9 .6"/>
   <joint name="{s}_ankle_roll" axis="1 0 0" range="-.4 .4"/>
   <site name="{s}_foot" pos=".03 0 -.03"/>
  </body></body></body>"""
_ARM = """
<body name="{s}_upper" pos="0 {y} .25"><geom size=".02" fromto="0 0 0 0 0 -.17" mass=".4"/>
 <joint name="{s}_shoulder_pitch" axis="0 1 0" range="-3 3"/>
 <joint name="{s}_shoulder_roll" axis="1 0 0" range="-2.5 2.5"/>
 <joint name="{s}_shoulder_yaw" axis="0 0 1" range="-2 2"/>
 <body name="{s}_lower" pos="0 0 -.2"><geom size=".018" fromto="0 0 0 0 0 -.15" mass=".3"/>
  <joint name="{s}_elbow" axis="0 1 0" range="-2.4 0"/></body></body>"""


def mjcf() -> str:
    """The model: 36 cm of leg, 37 cm of arm, one servo with a force range, one bounded joint."""
    sides = (("left", 1), ("right", -1))
    legs = "".join(_LEG.format(s=side, y=0.07 * sign) for side, sign in sides)
    arms = "".join(_ARM.format(s=side, y=0.16 * sign) for side, sign in sides)
    return f"""<mujoco model="machine"><compiler angle="radian" autolimits="true"/>
<default><geom type="capsule" contype="1" conaffinity="1"/></default>
<worldbody><body name="base" pos="0 0 .63"><freejoint name="root"/>
<geom type="box" size=".05 .08 .04" mass="2"/>{legs}
<body name="chest"><geom type="box" size=".05 .1 .08" pos="0 0 .18" mass="3"/>
<joint name="waist" axis="0 0 1" range="-1 1" actuatorfrcrange="-30 30"/>{arms}
<geom type="sphere" size=".06" pos="0 0 .36" mass=".5"/></body></body></worldbody>
<actuator><position joint="left_knee" kp="50" forcerange="-40 40" ctrlrange="0 2.4"/>
<motor joint="waist" gear="2" ctrlrange="-50 50"/></actuator>
<sensor><framepos objtype="site" objname="left_foot"/></sensor></mujoco>"""


def description(folder: Path) -> RobotDescription:
    """What a user would write in `configs/robots/machine.yaml`."""
    path = folder / "machine.xml"
    path.write_text(mjcf())
    none = (0.0, 0.0, 0.0)
    sites = {"pelvis": ("base", (0.0, 0.0, -0.05)), "head": ("chest", (0.0, 0.0, 0.36))}
    contacts = {}
    for side in ("left", "right"):
        sites |= {
            f"{side}_hip": (f"{side}_thigh", none),
            f"{side}_knee": (f"{side}_shin", none),
            f"{side}_foot": (f"{side}_sole", none),
            f"{side}_toe": (f"{side}_sole", (0.1, 0.0, -0.02)),
            f"{side}_shoulder": (f"{side}_upper", none),
            f"{side}_elbow": (f"{side}_lower", none),
            f"{side}_hand": (f"{side}_lower", (0.0, 0.0, -0.17)),
        }
        for label, x in (("heel", -0.04), ("toe", 0.1)):
            for edge, y in (("in", -0.03), ("out", 0.03)):
                contacts[f"{side}_{label}_{edge}"] = ContactPoint(
                    site=f"{side}_foot", offset=(x, y, -0.02), radius=0.01,
                    body=f"{side}_sole", side=side, label=label,
                )  # fmt: skip
    return RobotDescription(
        name="machine", mjcf=str(path), root_body="base", sites=sites, contacts=contacts,
        weights=dict.fromkeys(sites, 1.0),
        rest_pose={"*_hip_pitch": -0.2, "*_knee": 0.4, "*_ankle_pitch": -0.2, "*_elbow": -0.4},
        control_dt=0.02, torque_limits={"*_elbow": 7.0},
    )  # fmt: skip


def plain_model() -> mujoco.MjModel:
    """The model without anything that our description adds."""
    return mujoco.MjModel.from_xml_string(mjcf())
