"""`BipedWalk-Payload-v0`."""

from __future__ import annotations

from typing import Any

from artde_gym.envs import biped_vector
from artde_gym.envs.biped import BipedEnv, document

DISTURBANCES: dict[str, Any] = {"payload": 1.3}
_DEFAULT = "payload of 1.3 kg"


@document(_DEFAULT)
class BipedWalkPayloadEnv(BipedEnv):
    """Ojas, a 20-joint humanoid of 8.986 kg and 0.94 m, walks with a payload on its torso.

    ## Description
    A walking pattern (stand 2 s, walk, stand 2 s) is the reference of the twelve leg joints; the policy commands their
    torques. The policy does not observe payload, pushes and friction. After section 2.5 of Dantu, *Adaptive Artificial
    Time Delay Control for Robotic Systems* (2023); the robot's mass distribution and the pattern are this project's.

    {shared}

    ## Versions
    * v0: first version.
    """

    default_disturbances = DISTURBANCES


@biped_vector.document(_DEFAULT)
class BipedWalkPayloadVectorEnv(biped_vector.BipedVectorEnv):
    """Many robots walk with a payload, as in `BipedWalkPayloadEnv`.

    {shared}

    ## Versions
    * v0: first version.
    """

    default_disturbances = DISTURBANCES
