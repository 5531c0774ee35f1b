"""The controllers that this package brings, found by the entry-point group `artde_gym.controllers`."""

from __future__ import annotations

from artde_gym.registration import ControllerSpec


def _shipped(name: str, text: str, policies: dict[str, str]) -> ControllerSpec:
    """Describe policies of this package, by environment."""
    return ControllerSpec(name, "baselines.saved:make_shipped", {"policies": policies}, text)


CONTROLLERS = (
    _shipped(
        "tde+balance",
        "biped: TDE + a linear balance law of 28 gains that CMA-ES has tuned under pushes",
        dict.fromkeys(("BipedPush-v0", "BipedWalk-Payload-v0"), "biped-balance"),
    ),
    _shipped(
        "tde+ppo",
        "biped, quadrotor: TDE (with a cable TDE + swing) + a residual that reinforcement learning (PPO) has trained",
        {
            "BipedPush-v0": "biped-push",
            "BipedWalk-Payload-v0": "biped-walk",
            "QuadInfinity-Payload-v0": "quadrotor-gale",
            "QuadSling-Payload-v0": "quadrotor-sling",
        },
    ),
)
