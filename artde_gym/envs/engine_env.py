"""Base class of single environments whose robot is simulated in a physics engine."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.envs.closed_env import CLOSED
from artde_gym.envs.single import BaseEnv
from artde_gym.envs.view import View
from artde_gym.motion.motion import Pose
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.sim.engine import Camera, Engine
from artde_gym.sim.factory import EngineName, make_engine, resolve_engine


class EngineEnv(BaseEnv):
    """An environment with an engine and a view of its robot, which a subclass opens with `_open`."""

    nominal_robot: RobotSpec
    _engine: Engine

    def _open(
        self, engine: EngineName | None, robot: RobotSpec, camera: Camera, *, share: float = 1.0, slack: float = 0.0
    ) -> None:
        """Open an engine; None for the default one. `engine_name` is the selected one.

        See `artde_gym.envs.view.View` for the other arguments.
        """
        self.engine_name = resolve_engine(engine)
        renders = self.render_mode is not None
        self._engine = self._equipped(make_engine(self.engine_name, robot, self.time_step, renders=renders))
        self.view = View(self._engine, camera, self.control_period, share, slack)
        self.metadata = {**self.metadata, **self.view.metadata}

    def _equipped(self, engine: Engine) -> Engine:
        """Return the engine with what the task adds to it."""
        return engine

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        begun = super().reset(seed=seed, options=options)
        self.view.reset()
        return begun

    def _home(self) -> Vector:
        """Return the robot's nominal position (m)."""
        return (0.0, 0.0, 0.0)

    def _lines(self) -> dict[str, Any]:
        """Return the lines of a frame, arguments of `View.picture`."""
        return {}

    def _draw(self) -> NDArray[np.uint8]:
        step = self.elapsed
        pushes, over = self.schedule.acting(step), self._over
        time = step * self.time_step
        return self.view.picture(time, self._home(), pushes, self._sampled, over=over, **self._lines())

    def close(self) -> None:
        super().close()
        self._engine.close()
        self._engine = self.view = CLOSED

    def pose(self) -> Pose:
        """Read where robot and payload are, as they are and not as sensors see them."""
        state = self._engine.state()
        payload, loads = self._engine.payload_position(), self._engine.foot_loads()
        return Pose(state.position, state.quat_xyzw, state.q, payload, loads)

    @property
    def engine(self) -> Engine:
        """The physics engine, for reading."""
        return self._engine
