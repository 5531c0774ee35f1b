"""Saved policies at work: loaded for an environment, or for the one that they were trained on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from artde_gym.errors import ArtdeGymError, OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation.environments import ours, single
from artde_gym.layout import Layout
from baselines.agent import agent_of
from baselines.errors import PolicyFileError
from baselines.policy_file import DESCRIPTION, Saved, layout_hash, read
from baselines.residual import Residual, ResidualPolicy
from controllers import GainError
from controllers.policies import ControlInterface

SHIPPED = Path(__file__).parent / "policies"
RETRAIN = "train it again with this release"
EXPORT = "policy"
"""Folder of the best policy in that of a training run."""


def load(path: str | Path, env: Any = None) -> ResidualPolicy:
    """Load a saved policy, ready to `predict`.

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
    return _policy(saved, _trained_in(saved) if env is None else env)


def make_shipped(env: Any, *, policies: dict[str, str]) -> ResidualPolicy:
    """Load a shipped policy for an environment.

    Args:
        env: the environment that it will drive.
        policies: environment id -> name of the policy.

    Raises:
        UnknownNameError: if there is none for the environment, or if Gymnasium did not make it and it has no id.
        OptionError: for anything but names of policies of this package.
    """
    known = [path.name for path in SHIPPED.iterdir()]
    if not (isinstance(policies, dict) and all(name in known for name in policies.values())):
        raise OptionError("policies", policies, f"a mapping of environments to {suggest_names(None, known)}")
    spec = env.get_attr("spec")[0] if hasattr(env, "num_envs") else env.unwrapped.spec
    env_id = "" if spec is None else spec.id
    if env_id not in policies:
        raise UnknownNameError("environment of a trained policy", env_id, suggest_names(env_id, policies))
    return load(SHIPPED / policies[env_id], env)


def _trained_in(saved: Saved) -> Any:
    """Return a policy's training environment, built only if its robot alone does not suffice."""
    agent = agent_of(saved.config.robot)
    if agent.observation is not None and agent.action is not None:
        if saved.nominal not in agent.nominal:
            raise PolicyFileError("nominal_robot", saved.nominal, ", ".join(map(repr, agent.nominal)))
        layout = agent.observations.get(str(saved.about.get("env_id")), agent.observation)
        return _Trained(saved, layout, agent.action, agent.nominal[saved.nominal]())
    env_id, kwargs = saved.about.get("env_id"), saved.about.get("env_kwargs")
    if env_id not in ours() or not isinstance(kwargs, dict):  # never a "module:id", which would be imported
        raise PolicyFileError("about: env_id", env_id, suggest_names(env_id, ours()))
    return single(env_id, json.dumps(kwargs))


class _Trained:
    """Layouts and robot of a training's environment, without building it."""

    def __init__(self, saved: Saved, observation: Layout, action: Layout, nominal_robot: Any) -> None:
        self.robot_name = saved.config.robot
        self.observation_layout, self.action_layout = observation, action
        self.control_period = saved.control_period
        self.nominal_robot = nominal_robot

    @property
    def unwrapped(self) -> _Trained:
        return self


def nominal_name(robot: str, env_kwargs: dict[str, Any]) -> str:
    """Return the name by which a policy file refers to an environment's nominal robot."""
    name = agent_of(robot).nominal_name
    return robot if name is None else name(env_kwargs)


def _policy(saved: Saved, env: Any) -> ResidualPolicy:
    interface = ControlInterface.of(env)
    if interface.robot != saved.config.robot:
        problem = f"is not {interface.robot!r}, that of the environment"
        raise PolicyFileError(f"robot of {saved.name!r}", saved.config.robot, "choose another policy", problem)
    try:
        residual = Residual.of(env, saved.config)
    except (ArtdeGymError, GainError):
        raise
    except Exception as error:  # the recipe's gains may be anything, for a base that takes almost any
        problem = f"does not work ({error!r})"
        raise PolicyFileError(f"config of {saved.name!r}", saved.config, RETRAIN, problem) from error
    if layout_hash(residual.features) != saved.features or len(saved.network.mean) != residual.features.size:
        problem = f"differ from {layout_hash(residual.features)} here"
        raise PolicyFileError(f"features of {saved.name!r}", saved.features, RETRAIN, problem)
    if tuple(residual.actions) != saved.actions or len(saved.network.layers[-1][1]) != len(residual.actions):
        problem = f"differ from {tuple(residual.actions)} here"
        raise PolicyFileError(f"actions of {saved.name!r}", saved.actions, RETRAIN, problem)
    return ResidualPolicy(saved.name, interface, residual, saved.network)
