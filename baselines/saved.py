"""Saved policies at work: loaded for an environment, or for the one that they were trained on."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

from artde_gym.errors import ArtdeGymError, OptionError, UnknownNameError, among
from artde_gym.multibody.spec import RobotSpec
from artde_gym.robots.ojas import task as biped_task
from artde_gym.robots.ojas.model import ActuatorInertia, ojas
from artde_gym.robots.q450 import task as quadrotor_task
from artde_gym.robots.q450.model import q450
from baselines.errors import PolicyFileError
from baselines.policy_file import DESCRIPTION, Saved, layout_hash, read
from baselines.residual import Residual, ResidualPolicy
from controllers import GainError
from controllers.policies import Plant

SHIPPED = Path(__file__).parent / "policies"
EXPORT = "policy"
"""Folder of the best policy in that of a training run."""


def load(path: str | Path, env: Any = None) -> ResidualPolicy:
    """A saved policy, ready to `predict`.

    Args:
        path: its folder, or that of the training run that made it.
        env: the environment that it will drive, if that differs from the one of its training (say, in its control
            period); or a vector of such.

    Raises:
        PolicyFileError: if it cannot be read, or does not fit.
        OptionError: if its decisions do not fall on the environment's control periods.
    """
    folder = Path(path)
    if not (folder / DESCRIPTION).exists() and (folder / EXPORT / DESCRIPTION).exists():
        folder = folder / EXPORT
    saved = read(folder)
    return _policy(saved, _Trained(saved) if env is None else env)


def make_shipped(env: Any, *, policies: dict[str, str]) -> ResidualPolicy:
    """A policy of this package for an environment.

    Args:
        env: the environment that it will drive.
        policies: environment id -> name of the policy.

    Raises:
        UnknownNameError: if there is none for the environment, or if Gymnasium did not make it and it has no id.
        OptionError: for anything but names of policies of this package.
    """
    known = [path.name for path in SHIPPED.iterdir()]
    if not (isinstance(policies, dict) and all(name in known for name in policies.values())):
        raise OptionError("policies", policies, f"a mapping of environments to {among(None, known)}")
    spec = env.get_attr("spec")[0] if hasattr(env, "num_envs") else env.unwrapped.spec
    env_id = "" if spec is None else spec.id
    if env_id not in policies:
        raise UnknownNameError("environment of a trained policy", env_id, among(env_id, policies))
    return load(SHIPPED / policies[env_id], env)


class _Trained:
    """What a policy has to know of the environment of its training, without building it."""

    def __init__(self, saved: Saved) -> None:
        task = {"ojas": biped_task, "q450": quadrotor_task}[saved.recipe.robot]
        self.robot_name = saved.recipe.robot
        self.observation_layout, self.action_layout = task.OBSERVATION, task.ACTION
        self.control_period = saved.control_period
        self.nominal_robot = _nominal_robot(self.robot_name, saved.nominal)

    @property
    def unwrapped(self) -> _Trained:
        return self


def _nominal_robot(robot: str, name: str) -> RobotSpec:
    known = {"q450": q450} if robot == "q450" else {f"ojas {kind}": ojas for kind in get_args(ActuatorInertia)}
    if name not in known:
        raise PolicyFileError("nominal_robot", name, ", ".join(map(repr, known)))
    return known[name](*name.split()[1:])


def nominal_name(robot: str, env_kwargs: dict[str, Any]) -> str:
    """How a policy's file names the nominal robot of an environment."""
    return robot if robot == "q450" else f"{robot} {env_kwargs.get('actuator_inertia', 'rotor')}"


def _policy(saved: Saved, env: Any) -> ResidualPolicy:
    plant = Plant.of(env)
    if plant.robot != saved.recipe.robot:
        raise PolicyFileError(f"robot of {saved.name!r}", saved.recipe.robot, f"{plant.robot!r} of the environment")
    try:
        residual = Residual.of(env, saved.recipe)
    except (ArtdeGymError, GainError):
        raise
    except Exception as error:  # the recipe's gains may be anything, for a base that takes almost any
        raise PolicyFileError(f"recipe of {saved.name!r}", saved.recipe, f"one that works ({error!r})") from error
    if layout_hash(residual.features) != saved.features or len(saved.network.mean) != residual.features.size:
        raise PolicyFileError(f"what {saved.name!r} sees", saved.features, f"{layout_hash(residual.features)} here")
    if tuple(residual.actions) != saved.actions or len(saved.network.layers[-1][1]) != len(residual.actions):
        raise PolicyFileError(f"what {saved.name!r} does", saved.actions, f"{tuple(residual.actions)} here")
    return ResidualPolicy(saved.name, plant, residual, saved.network)
