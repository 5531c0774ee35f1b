"""Ojas, the 20-joint humanoid of the thesis: 8.986 kg, 0.94 m.

The thesis gives mass, height and the joints; the distribution over the links is ours (`docs/deviations.md`).
Base frame: at the middle of the hip line; x forward, y left, z up. Leg joints q1..q6: hip yaw (z), hip roll (x),
hip pitch (y), knee (y), ankle pitch (y), ankle roll (x); hip axes intersect, ankle axes intersect.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Literal

from artde_gym.errors import OptionError
from artde_gym.multibody.spec import Box, Link, RobotSpec, Vector, box_link

ActuatorInertia = Literal["rotor", "lumped", "none"]

TOTAL_MASS = 8.986  # kg, thesis section 2.5
THIGH = 0.20  # m, hip to knee
SHANK = 0.20  # m, knee to ankle
ANKLE_HEIGHT = 0.05  # m, ankle to sole
HIP_OFFSET = 0.065  # m, hip to the middle of the hip line
FOOT_SIZE: Vector = (0.20, 0.11, 0.02)
FOOT_CENTRE_AHEAD = 0.02  # m, middle of the foot ahead of the ankle
TORSO_CENTRE: Vector = (0.0, 0.0, 0.16)
TORQUE_LIMIT = 40.0  # Nm
ARMATURE = 0.045  # kg m^2, of a rotor and its gear, reflected to each leg joint
GEAR_RATIO = 10.0
LUMPED_ARMATURE = (0.08, 0.08, 0.08, 0.12, 0.08, 0.05)  # kg m^2, discs for q1..q6
LUMPED_BASE_INERTIA = 0.03  # kg m^2

LEG_JOINTS = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")
ARM_JOINTS = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow")
SIDES = ("left", "right")

_ARMS = tuple(f"{side}_{joint}" for side in SIDES for joint in ARM_JOINTS)
_X: Vector = (1.0, 0.0, 0.0)
_Y: Vector = (0.0, 1.0, 0.0)
_Z: Vector = (0.0, 0.0, 1.0)
_DARK = (0.20, 0.22, 0.26, 1.0)
_BLUE = (0.16, 0.36, 0.60, 1.0)
_LIGHT = (0.85, 0.86, 0.88, 1.0)


@functools.cache
def ojas(actuator_inertia: ActuatorInertia = "rotor", *, arms: Literal["fixed", "revolute"] = "fixed") -> RobotSpec:
    """Ojas with one of its actuator models.

    Args:
        actuator_inertia: "rotor", geared rotors whose inertia the joints feel; "lumped", discs on the child links,
            faster to simulate in Bullet; "none", bare links: then eig(M^-1 m_bar) leaves (0, 2) and TDE diverges.
        arms: "fixed" as in the thesis' experiments (12 joints move), or "revolute" (all 20).

    Raises:
        OptionError: for an unknown actuator model or arm mode.
    """
    if arms not in ("fixed", "revolute"):
        raise OptionError("arms", arms, "'fixed', 'revolute'")
    links = [*(link for side in SIDES for link in _leg(side)), *(link for side in SIDES for link in _arm(side))]
    if arms == "fixed":
        links = [dataclasses.replace(link, axis=None) if link.name in _ARMS else link for link in links]
    head = Link(
        name="head",
        mass=0.6,
        com=(0.0, 0.0, 0.11),
        inertia=(0.0016, 0.0016, 0.00144),
        parent="torso",
        origin=(0.0, 0.0, 0.30),
        visuals=(
            Box((0.05, 0.05, 0.05), (0.0, 0.0, 0.025), _DARK),
            Box((0.12, 0.12, 0.15), (0.0, 0.0, 0.115), _LIGHT),
            Box((0.01, 0.09, 0.03), (0.06, 0.0, 0.125), _DARK),
        ),
    )
    torso_mass = TOTAL_MASS - math.fsum(link.mass for link in (*links, head))
    torso = box_link("torso", torso_mass, (0.12, 0.20, 0.28), TORSO_CENTRE)
    torso = dataclasses.replace(torso, visuals=(Box((0.12, 0.20, 0.28), TORSO_CENTRE, _BLUE),))
    legs = tuple(f"{side}_{joint}" for side in SIDES for joint in LEG_JOINTS)
    bare = RobotSpec(
        name="ojas",
        links=(torso, head, *links),
        actuated=legs,
        torque_limit=TORQUE_LIMIT,
        feet=("left_ankle_roll", "right_ankle_roll"),
        armature=(ARMATURE,) * len(legs),
        gear_ratio=GEAR_RATIO,
        sites=(
            ("torso", "torso", TORSO_CENTRE),
            ("chest", "torso", (0.06, 0.0, 0.22)),
            ("left_arm", "left_shoulder_yaw", (0.0, 0.0, -0.06)),
            ("right_arm", "right_shoulder_yaw", (0.0, 0.0, -0.06)),
            *((f"{side}_foot", f"{side}_ankle_roll", (FOOT_CENTRE_AHEAD, 0.0, -ANKLE_HEIGHT)) for side in SIDES),
        ),
    ).merged()
    if actuator_inertia == "rotor":
        return bare
    if actuator_inertia == "lumped":
        return bare.with_lumped_armature(LUMPED_ARMATURE * 2, LUMPED_BASE_INERTIA)
    if actuator_inertia == "none":
        return dataclasses.replace(bare, armature=(0.0,) * len(legs))
    raise OptionError("actuator_inertia", actuator_inertia, "'rotor', 'lumped', 'none'")


def _leg(side: str) -> tuple[Link, ...]:
    y = HIP_OFFSET if side == "left" else -HIP_OFFSET
    name = {joint: f"{side}_{joint}" for joint in LEG_JOINTS}
    thigh: Vector = (0.08, 0.07, THIGH)
    shank: Vector = (0.07, 0.06, SHANK)
    foot_center: Vector = (FOOT_CENTRE_AHEAD, 0.0, -ANKLE_HEIGHT + FOOT_SIZE[2] / 2)
    foot = box_link(name["ankle_roll"], 0.25, FOOT_SIZE, foot_center, name["ankle_pitch"], axis=_X, collides=True)
    return (
        box_link(name["hip_yaw"], 0.20, (0.06, 0.06, 0.06), (0.0, 0.0, 0.0), "torso", (0.0, y, 0.0), _Z),
        box_link(name["hip_roll"], 0.25, (0.06, 0.06, 0.06), (0.0, 0.0, 0.0), name["hip_yaw"], axis=_X),
        box_link(name["hip_pitch"], 0.75, thigh, (0.0, 0.0, -THIGH / 2), name["hip_roll"], axis=_Y),
        box_link(name["knee"], 0.50, shank, (0.0, 0.0, -SHANK / 2), name["hip_pitch"], (0.0, 0.0, -THIGH), _Y),
        box_link(name["ankle_pitch"], 0.20, (0.05, 0.05, 0.05), (0.0, 0.0, 0.0), name["knee"], (0.0, 0.0, -SHANK), _Y),
        dataclasses.replace(foot, visuals=(Box(FOOT_SIZE, foot_center, _DARK),)),
    )


def _arm(side: str) -> tuple[Link, ...]:
    y = 0.125 if side == "left" else -0.125
    pitch, roll, yaw, elbow = (f"{side}_{joint}" for joint in ARM_JOINTS)
    upper: Vector = (0.05, 0.05, 0.14)
    return (
        box_link(pitch, 0.15, (0.05, 0.05, 0.05), (0.0, 0.0, 0.0), "torso", (0.0, y, 0.26), _Y),
        box_link(roll, 0.15, (0.05, 0.05, 0.05), (0.0, 0.0, 0.0), pitch, axis=_X),
        box_link(yaw, 0.25, upper, (0.0, 0.0, -0.07), roll, axis=_Z),
        box_link(elbow, 0.25, (0.045, 0.045, 0.16), (0.0, 0.0, -0.08), yaw, (0.0, 0.0, -0.14), _Y),
    )
