"""The motion of one robot in one episode, as environments tell it and as traces keep it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from artde_gym.arrays import Array
from artde_gym.motion.packing import Packed
from artde_gym.multibody.spec import Vector

HZ = 60.0
"""Rate of stored motion, as far as the control period allows."""
PLACE, TURN, JOINT, FORCE = 1e-4, 1 / 16384, 1e-4, 0.5  # units: m, 1, rad or m, N
DEEPEST = -0.3  # m, below which a payload that has fallen through the ground is gone
SHOWN = 1800  # samples at most in a page: half a minute at full rate, a minute at half of it
KEY = "motion."  # of its arrays in traces


class Pose(NamedTuple):
    """A robot at one instant, without errors of measurement: what an environment's `pose` returns.

    Attributes:
        position, quat_xyzw: of the base link's origin, world axes (m, 1).
        q: joints (n,), as the robot's scene counts them (rad, or m for one that slides).
        payload: its center (m); None without one.
        loads: normal forces (N) at the contacts of the robot's scene.
    """

    position: Vector
    quat_xyzw: tuple[float, float, float, float]
    q: Sequence[float] | Array = ()
    payload: Vector | None = None
    loads: Sequence[float] = ()


@dataclasses.dataclass(frozen=True)
class Motion:
    """Poses every `period` (s), one a row.

    Attributes:
        base: position and quaternion (x, y, z, w) without jumps of sign (samples, 7).
        q: joints (samples, n).
        payload: (samples, 3), NaN where there is none.
        loads: (samples, contacts).
    """

    period: float
    base: Array
    q: Array
    payload: Array
    loads: Array

    @classmethod
    def of(cls, poses: Sequence[Pose], period: float) -> Motion:
        """Gather poses."""
        base = np.array([(*pose.position, *pose.quat_xyzw) for pose in poses], np.float64)
        turns = np.where((base[1:, 3:] * base[:-1, 3:]).sum(axis=1) < 0, -1.0, 1.0)
        base[1:, 3:] *= np.cumprod(turns)[:, None]  # one of the two quaternions of an attitude
        q = np.array([pose.q for pose in poses], np.float64)
        loads = np.array([pose.loads for pose in poses], np.float64)
        payload = np.array([pose.payload or (np.nan,) * 3 for pose in poses], np.float64)
        payload[payload[:, 2] < DEEPEST] = np.nan
        return cls(period, base, q, payload, loads)

    @classmethod
    def read(cls, traces: Mapping[str, Array]) -> Motion | None:
        """Take the motion from among an episode's traces; None where it was not recorded."""
        if f"{KEY}planes" not in traces:
            return None
        arrays: Mapping[str, Any] = {name: traces[KEY + name] for name in Packed._fields}
        columns = Packed(**arrays).columns()
        joints = int(traces[f"{KEY}joints"])
        base, q, payload, there, loads = np.split(columns, np.cumsum([7, joints, 3, 1]), axis=1)
        return cls(float(traces[f"{KEY}period"]), base, q, np.where(there > 0.5, payload, np.nan), loads)

    def packed(self) -> Packed:
        """Pack base, joints, the payload's place and whether there is one, and loads, in this order."""
        there = np.isfinite(self.payload[:, :1])
        columns = np.hstack([self.base, self.q, _held(self.payload), there, self.loads])
        joints, contacts = self.q.shape[1], self.loads.shape[1]
        units = [*[PLACE] * 3, *[TURN] * 4, *[JOINT] * joints, *[PLACE] * 3, 1.0, *[FORCE] * contacts]
        return Packed.of(columns, units)

    def traces(self) -> dict[str, Array]:
        """Return it as arrays among an episode's traces."""
        about = {"period": np.array(self.period), "joints": np.array(self.q.shape[1])}
        return {KEY + name: values for name, values in (self.packed()._asdict() | about).items()}

    def thinned(self) -> Motion:
        """Return every n-th sample, so that they are `SHOWN` at most."""
        stride = -(-len(self.base) // SHOWN)
        parts = (part[::stride] for part in (self.base, self.q, self.payload, self.loads))
        return Motion(stride * self.period, *parts)

    def text(self) -> dict[str, Any]:
        """Return what a page holds."""
        return {"period": self.period, "joints": self.q.shape[1], **self.packed().text()}


def _held(payload: Array) -> Array:
    """Replace what is not there (samples, 3) by what was there last, or will be first."""
    seen = np.flatnonzero(np.isfinite(payload[:, 0]))
    if not len(seen):
        return np.zeros_like(payload)
    last = np.searchsorted(seen, np.arange(len(payload)), side="right") - 1
    return payload[seen[np.maximum(last, 0)]]
