"""`BipedPush-v0`."""

from __future__ import annotations

from typing import Any

from artde_gym.envs import biped_vector
from artde_gym.envs.biped import BipedEnv, document
from artde_gym.robots.ojas.pushes import ARM_PUSH, CHEST_PUSH

DISTURBANCES: dict[str, Any] = {"payload": 1.3, "push": [CHEST_PUSH, ARM_PUSH]}
_DEFAULT = "payload of 1.3 kg and the two pushes"


@document(_DEFAULT)
class BipedPushEnv(BipedEnv):
    """Ojas walks with a payload and is pushed twice: on the chest at 28 s, on the left arm at 37 s.

    ## Description
    Scenario S3 of Dantu, *Adaptive Artificial Time Delay Control for Robotic Systems* (2023): a payload of 1.3 kg, 10 N
    on the chest, forward, and 10 N on the left upper arm at 45 degrees to the vertical, inward and down. The thesis
    calls the pushes impulsive and gives no duration; 0.2 s here. With `arms="fixed"` the arm is one body with the
    torso, and the push acts at the arm's own place on it; with `arms="revolute"` it acts on the arm's link.
    `disturbances` replaces payload and pushes together.

    {shared}

    ## Versions
    * v0: first version.
    """

    default_disturbances = DISTURBANCES


@biped_vector.document(_DEFAULT)
class BipedPushVectorEnv(biped_vector.BipedVectorEnv):
    """Many robots walk with a payload and are pushed twice, as the one of `BipedPushEnv`.

    {shared}

    ## Versions
    * v0: first version.
    """

    default_disturbances = DISTURBANCES
