"""Control laws and policies for artde_gym's environments.

`make("artde", env)` gives a policy with Stable-Baselines3's `predict`; the laws themselves are pure functions in
`controllers.laws`. `register_law` makes a law of your own, a `LawSpec`, a controller.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from artde_gym.lazy import lazy
from artde_gym.registration import make_controller
from controllers.laws.errors import GainError

if TYPE_CHECKING:
    from controllers.law_spec import LawSpec
    from controllers.registration import register_law

__all__ = ["GainError", "LawSpec", "make", "register_law"]

__getattr__ = lazy(__name__, {"LawSpec": "controllers.law_spec", "register_law": "controllers.registration"})


def make(name: str, env: Any, **overrides: Any) -> Any:
    """Make the controller called `name` for an environment, or for a vector of equal ones.

    Args:
        name: "tde", "atde", "artde", "artde-robust", "pid", "tde+c", "tde+kd"; for the biped "computed-torque",
            "tde-stiff", "atde-stiff", "artde-stiff", "tde-switched", "atde-switched" and "artde-switched"; for the
            quadrotor "tde-tight", "asmc", "geometric", "indi", with a cable "tde+swing", "atde+swing", "artde+swing"
            and "geometric-load"; or whatever was given to `artde_gym.register_controller`.
        env: the environment that it will drive; its robot decides which policy the name stands for.
        overrides: gains in place of the preset's, and `preset="thesis"`, `"robust"`, ...; for laws on all joints also
            `velocity_cutoff_hz` and `time_base`, see `controllers.joint_space.make_joint_space`; of the quadrotor's two
            loops a gain has the suffix `_p` (position) or `_q` (attitude).

    Raises:
        UnknownNameError: for a controller that is not registered or that the robot does not have, or an unknown preset.
        GainError: for an unknown gain or a value that is not allowed.
    """
    return make_controller(name, env, **overrides)
