"""Control laws as policies: observation in, action out, with Stable-Baselines3's `predict`.

A policy holds no state of its own. Its law's state goes out of `predict` and comes back in as `state`, a tuple of
arrays with the observations' leading axes, so that one policy object serves any number of environments at once.
"""

from __future__ import annotations

import abc
import copy
from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artde_gym.errors import OptionError
from artde_gym.layout import Layout
from controllers.laws.namespaces import namespace
from controllers.laws.tracking import Array, JointInput, LawState
from controllers.stacked import stacked_gains

PACKAGE = f"{__package__}."


class ControlInterface(NamedTuple):
    """An environment as its policy knows it: robot, layouts, bounds and control period."""

    robot: str
    observation: Layout
    action: Layout
    control_period: float
    nominal_robot: Any

    @classmethod
    def of(cls, env: Any) -> ControlInterface:
        """Read from a Gymnasium environment, wrapped or not, or from a vector of equal ones (Gymnasium's or SB3's).

        Raises:
            OptionError: for an environment that no robot of this project, or of a plug-in, drives.
        """

        def read(name: str) -> Any:
            return env.get_attr(name)[0] if hasattr(env, "num_envs") else getattr(env.unwrapped, name)

        names = ("robot_name", "observation_layout", "action_layout", "control_period", "nominal_robot")
        try:
            return cls(*(read(name) for name in names))
        except AttributeError as error:
            allowed = f"one of artde_gym or of a plug-in ({error})"
            raise OptionError("environment to be controlled", env, allowed) from error


class Policy(abc.ABC):
    """A law on the environment's observations; subclasses say what it reads and what happens in one sample.

    Args:
        name: under which results are listed.
        interface: the environment that it drives.
        gains: of the law, in its own terms.

    Attributes:
        any_library: whether observations keep their array library; otherwise they become NumPy's.
    """

    any_library = True

    def __init__(self, name: str, interface: ControlInterface, gains: Any) -> None:
        self.name = name
        self.gains = gains
        self._size = interface.observation.size
        box = interface.action.box()
        self._low, self._high = box.low, box.high

    @property
    def code(self) -> tuple[Any, ...]:
        """Functions and classes beside its own class whose source decides what it does."""
        return ()

    @abc.abstractmethod
    def read(self, observation: Array) -> Any:
        """Return the signals of one sample in an observation (..., n_obs)."""

    @abc.abstractmethod
    def start(self, signals: Any) -> LawState:
        """Return the state before the first sample."""

    @abc.abstractmethod
    def step(self, state: Any, signals: Any, observation: Array) -> tuple[Array, LawState]:
        """Compute one sample: force (..., n) before saturation, and the next state."""

    @abc.abstractmethod
    def with_residual(self, signals: Any, du: Array) -> Any:
        """Add `du` (..., n) to the reference acceleration, and so to the desired one of any law."""

    def predict(
        self,
        observation: ArrayLike,
        state: LawState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
        *,
        residual: ArrayLike | None = None,
    ) -> tuple[Array, LawState]:
        """Return the action for one observation (n_obs,) or for many (n_env, n_obs).

        Args:
            observation: as the environment gave it; float32 stays float32. An array of another library, from a
                simulation in JAX or PyTorch, gives an action of that library, in `jit` and `vmap` too.
            state: what the call before returned; None at the start.
            episode_start: one truth value an environment; where it is true, that environment's state is cleared.
            deterministic: of the protocol; a law has no randomness.
            residual: du (..., n), added to the law's desired acceleration; zero is the same as none, bit for bit.

        Raises:
            OptionError: if the observation's last axis is not as long as the environment's, or the law's first force
                has not one component an actuator.
        """
        del deterministic
        xp = namespace(observation) if self.any_library else np
        given = np.asarray(observation) if xp is np else cast(Array, observation)
        if given.shape[-1:] != (self._size,):
            raise OptionError("shape of the observation", given.shape, f"(..., {self._size})")
        signals = self.read(given)
        begins = state is None
        if state is None:
            state = self.start(signals)
        elif episode_start is not None:
            fresh = xp.asarray(episode_start, dtype=xp.bool).reshape(given.shape[:-1])
            if xp is not np or fresh.any():
                state = choose(fresh, self.start(signals), state, xp)
        if residual is not None:
            signals = self.with_residual(signals, xp.asarray(residual, dtype=given.dtype))
        force, state = self.step(state, signals, given)
        if begins and tuple(force.shape) != (*given.shape[:-1], *self._low.shape):  # bounds would broadcast it
            raise OptionError(f"shape of the force of {self.name!r}", tuple(force.shape), f"(..., {len(self._low)})")
        if xp is not np:
            low, high = (xp.asarray(bound, dtype=force.dtype) for bound in (self._low, self._high))
            return xp.minimum(xp.maximum(force, low), high), state
        clipped = np.minimum(np.maximum(force, self._low), self._high)
        return clipped if clipped.dtype == force.dtype else clipped.astype(force.dtype), state

    def law(self) -> tuple[str, float] | None:
        """Return the law and the period L that it divides by (s); None where more than gains tells policies apart."""
        return None

    def stacked(self, policies: Sequence[Any]) -> Policy | None:
        """Return one policy that drives each row of observations as the policy at its place would alone, bit for bit.

        None where it cannot: the policies differ in more than gains, or in gains that a law takes one by one, or their
        class, law or gains are not this package's, so that no one knows how they take them.
        """
        own = all(getattr(part, "__module__", "").startswith(PACKAGE) for part in (type(self), *self.code))
        same = all(type(policy) is type(self) and policy.law() == self.law() for policy in policies)
        if self.law() is None or not (own and same):
            return None
        gains = stacked_gains([policy.gains for policy in policies])
        if gains is None:
            return None
        whole = copy.copy(self)
        whole.gains = gains
        return whole

    def internals(self, state: LawState) -> dict[str, Array]:
        """Return the law's internal signals by name: sigma, s, beta, c, ..., as far as it has them."""
        return flatten(state)

    def diagnostics(self, state: LawState) -> dict[str, Array]:
        """Return the internals and all that follows from them, for traces and metrics."""
        return self.internals(state)

    def preview(self, state: LawState, signals: Any) -> dict[str, Array]:
        """Return signals of the next step by name that the observation alone does not hold."""
        del state, signals
        return {}


class TrackingPolicy(Policy):
    """A law on the joints' `JointInput`, each a field of the observation."""

    def __init__(self, name: str, interface: ControlInterface, gains: Any) -> None:
        super().__init__(name, interface, gains)
        self._parts = [(..., interface.observation[field]) for field in JointInput._fields]

    def read(self, observation: Array) -> JointInput:
        return JointInput._make(map(observation.__getitem__, self._parts))

    def with_residual(self, signals: JointInput, du: Array) -> JointInput:
        return signals._replace(qdd_ref=signals.qdd_ref + du)


def choose(mask: NDArray[np.bool_], fresh: Array | LawState, kept: Array | LawState, xp: Any = np) -> Any:
    """Nested tuples of arrays: `fresh` where the mask is true, `kept` elsewhere; the mask covers leading axes."""
    if isinstance(fresh, tuple):
        merged = [choose(mask, *pair, xp) for pair in zip(fresh, kept, strict=True)]
        kind: Any = type(fresh)
        return kind(*merged) if hasattr(kind, "_fields") else kind(merged)
    new, old = xp.asarray(fresh), xp.asarray(kept)
    return xp.where(mask.reshape(mask.shape + (1,) * (old.ndim - mask.ndim)), new, old)


def flatten(state: Any) -> dict[str, Array]:
    """All arrays in nested named tuples by their names."""
    named: dict[str, Array] = {}
    for name, value in state._asdict().items():
        if isinstance(value, tuple):
            named.update(flatten(value))
        else:
            named[name] = value
    return named
