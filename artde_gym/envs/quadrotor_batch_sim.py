"""NumPy simulation of many quadrotors as rigid bodies; the counterpart of the engine in `artde_gym.envs.quadrotor`.

Vehicle and payload are one body until the payload is dropped. Time has the grid `GRID`: forces are constant over a
step, the wind is taken at the vehicle's position in the middle of the step, and events occur between steps.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances.effects import Effects
from artde_gym.disturbances.ground_effect import thrust_gain
from artde_gym.disturbances.kinds import OWN
from artde_gym.disturbances.loads import RobotStates
from artde_gym.disturbances.noise import uniform_noise
from artde_gym.disturbances.schedule import ATTACHED, DROPPED, NEVER, PUSH_BEGINS, PUSH_ENDS, Push
from artde_gym.disturbances.wind import GRID, Air, advance, air, processes, velocity
from artde_gym.kit import PAYLOAD
from artde_gym.multibody.lag import follow, lag_shares
from artde_gym.robots.q450 import model as robot
from artde_gym.robots.q450 import task
from artde_gym.sim.cables import Cables
from artde_gym.sim.engine import PAYLOAD_RADIUS
from artde_gym.sim.rigid_bodies import MassProperties, RigidBodies, composite, cross, times, transposed_times

PUSH_RESOLUTION = 0.001  # s
PARTS = round(GRID / PUSH_RESOLUTION)
DELAY_SLOTS = int(OWN["action_delay"].parameters[0].high) + 1  # commands stored for the longest delay

_SITES = {name: place for name, _, place in robot.q450().sites}


class _Event(NamedTuple):
    """An event of one vehicle at the beginning of a step; `told` are its names in `EVENTS`."""

    step: int
    told: tuple[str, ...]
    act: Callable[[], None]


class QuadrotorBatchSim:
    """A simulation of `n` vehicles.

    Args:
        n: number of vehicles.
        steps: grid steps per control period.
        dtype: data type of all numbers.
        lift: height by which the path is raised (m).

    Attributes:
        bodies: rigid-body states.
        thrusts: current thrusts of the rotors (4, n) (N).
        cables: cables with loads; None before a vehicle has had one.
        pulled: impulse of each cable during the last control period (n,) (N s).
        wrenches: mean [u1, u2, u3, u4] of the last control period (4, n) (N, Nm), without the gain near the ground.
    """

    def __init__(self, n: int, steps: int, dtype: DTypeLike, lift: float = 0.0) -> None:
        self.bodies = RigidBodies(n, dtype)
        self.thrusts, self.wrenches = np.zeros((4, n), dtype), np.zeros((4, n), dtype)
        self._steps, self._lift = steps, lift
        self._step = 0  # since construction
        self._begun = np.zeros(n, np.int64)  # step at which each episode began
        self._agenda: list[list[_Event]] = [[] for _ in range(n)]  # of each vehicle, the next event last
        self._due = np.full(n, NEVER)  # step of each vehicle's next event
        self._shares = np.zeros((2, n), dtype)  # of the rotors' lag
        self._left = np.ones((4, n), dtype)  # remaining share of each rotor's thrust
        self._delay = np.zeros(n, np.int64)  # control periods
        self._late: Array | None = None  # targets of the last periods (DELAY_SLOTS, 4, n), once a vehicle needs them
        self._air = np.zeros((len(Air._fields), n), dtype)
        self._keys = np.zeros(n, np.uint64)
        self._wind = np.zeros((4, n), dtype)  # states of the wind's processes
        self._keep, self._kick = np.zeros((4, n), dtype), np.zeros((4, n), dtype)
        self._windy = False
        self._ground_effect = np.zeros(n, dtype)
        self._near_ground = False  # any vehicle with ground effect
        self._pushes = np.zeros((0, 3, n), dtype)  # forces that act (N, world axes)
        self._places = np.zeros((0, 3, n), dtype)  # points of application (m, body axes)
        self._at_load = np.zeros((0, n), np.bool_)  # which of them push the payload
        self._carries = np.zeros(n, np.bool_)  # a rigidly attached payload
        self.cables: Cables | None = None  # once a vehicle needs one
        self.pulled = np.zeros(n, dtype)
        self._effects = Effects(n, task.WORDS)
        self._affected = False  # any vehicle by effects

    def begin(self, vehicles: NDArray[np.intp], sampled: Sequence[Mapping[str, Any]], keys: NDArray[np.uint64]) -> None:
        """Begin episodes of some vehicles in equilibrium, with sampled disturbances and the keys of their winds."""
        self._begun[vehicles], self._keys[vehicles] = self._step, keys
        self._begin_rotors(vehicles, sampled)
        self._begin_air(vehicles, sampled)
        factor = np.array([own.get("mass_scale", {}).get("factor", 1.0) for own in sampled])
        inertia = factor[:, None, None] * np.diag(robot.INERTIA)
        bare = MassProperties(factor * robot.MASS, np.zeros((len(vehicles), 3)), inertia)
        if self.cables is not None:
            self.cables.clear(vehicles)
        self.pulled[vehicles] = 0.0
        starts = np.array([task.start(own, self._lift) for own in sampled])
        self._carries[vehicles] = False
        self.bodies.begin(vehicles, bare, starts.T)
        payloads = [own.get("payload") for own in sampled]
        carrying = [row for row, payload in enumerate(payloads) if payload is not None and _is_carried(payload)]
        changes = self._begin_payloads(vehicles, carrying, payloads, bare, starts) if carrying else {}
        for row, (vehicle, own) in enumerate(zip(vehicles.tolist(), sampled, strict=True)):
            self._effects.begin(vehicle, own)
            events = [*self._push_events(vehicle, own), *self._loss_events(vehicle, own), *changes.get(row, ())]
            events.sort(key=lambda event: event.step)
            self._agenda[vehicle] = events[::-1]
            self._set_due(vehicle)
        self._soonest, self._affected = self._due.min(), bool(self._effects.acting.any())

    def _begin_air(self, vehicles: NDArray[np.intp], sampled: Sequence[Mapping[str, Any]]) -> None:
        winds = [own.get("wind") for own in sampled]
        self._air[:, vehicles] = np.array([air(wind) for wind in winds]).T
        self._keep[:, vehicles], self._kick[:, vehicles] = np.array([processes(wind) for wind in winds]).transpose(
            1, 2, 0
        )
        self._wind[:, vehicles] = 0.0
        self._windy |= any(wind is not None for wind in winds)
        self._ground_effect[vehicles] = [own.get("ground_effect", {}).get("strength", 0.0) for own in sampled]
        self._near_ground = bool(self._ground_effect.any())

    def _begin_payloads(
        self,
        vehicles: NDArray[np.intp],
        rows: list[int],
        payloads: Sequence[Mapping[str, Any] | None],
        bare: MassProperties,
        starts: Array,
    ) -> dict[int, list[_Event]]:
        """Give the vehicles in some rows the payloads with which they begin; return their later events by row."""
        carried = {row: payload for row in rows if (payload := payloads[row]) is not None}
        fixed = composite(_some(bare, rows), _balls(list(carried.values())))
        events: dict[int, list[_Event]] = {}
        rigid = []  # rows, of all vehicles and of these
        for number, (row, payload) in enumerate(carried.items()):
            vehicle = int(vehicles[row])
            attach, drop = self._changes(vehicle, _one(bare, row), _one(fixed, number), payload)
            events[row] = own = []
            if payload["attach_time"] > 0:
                own.append(_Event(round(payload["attach_time"] / GRID), (ATTACHED,), attach))
            elif payload["cable"]:
                attach()
            else:
                rigid.append((row, number))
            own.append(_Event(round(payload["detach_time"] / GRID), (DROPPED,), drop))
        if rigid:
            whole, part = map(list, zip(*rigid, strict=True))
            self._carries[vehicles[whole]] = True
            self.bodies.begin(vehicles[whole], _some(fixed, part), starts[whole].T)
        return events

    def _changes(
        self, vehicle: int, bare: MassProperties, fixed: MassProperties, payload: Mapping[str, Any]
    ) -> tuple[Callable[[], None], Callable[[], None]]:
        """Return the functions that attach a payload and that drop it."""
        if not payload["cable"]:
            return partial(self._fix, vehicle, fixed, True), partial(self._fix, vehicle, bare, False)
        if self.cables is None:
            self.cables = Cables(len(self._begun), self.thrusts.dtype)
        hang = partial(self.cables.hang, vehicle, self.bodies, payload["mass"], payload["position"], payload["cable"])
        return hang, partial(self.cables.release, vehicle)

    def _fix(self, vehicle: int, properties: MassProperties, carries: bool) -> None:
        """Make a vehicle and what it carries one body."""
        self.bodies.set_properties(vehicle, properties)
        self._carries[vehicle] = carries

    def rest(self, vehicle: int) -> None:
        """Cancel all events of a vehicle until its next episode."""
        self._agenda[vehicle] = []
        self._await(vehicle)

    def motion(self, vehicles: NDArray[np.int64]) -> list[Array]:
        """Copy the motion state of some vehicles for `stop`."""
        return [part[..., vehicles] for part in self._moving()]

    def stop(self, vehicles: NDArray[np.int64], motion: list[Array]) -> None:
        """Restore the motion state of some vehicles."""
        for part, before in zip(self._moving(), motion, strict=True):
            part[..., vehicles] = before

    def _moving(self) -> tuple[Array, ...]:
        loads = () if self.cables is None else (*self.cables.motion(), self.pulled)
        return *self.bodies.motion(), self.thrusts, self.wrenches, *loads

    def advance(self, commands: Array) -> dict[int, list[str]]:
        """Apply wrenches [u1, u2, u3, u4] (4, n) (N, Nm) for one control period; return events by vehicle."""
        events: dict[int, list[str]] = {}
        bodies, aims = self.bodies, self._aims(commands)
        goals = aims * self._left
        noise = self._noise() if self._windy else None
        total = np.zeros_like(self.thrusts)
        if self.cables is not None:
            self.pulled = np.zeros_like(self.pulled)
        constants = Air._make(self._air) if self._windy else None
        for step in range(self._steps):
            self._drift(GRID if step else 0.5 * GRID)
            if self._step >= self._soonest:
                self._happen(events)
                goals = aims * self._left
            self.thrusts, mean = follow(self.thrusts, goals, *self._shares)
            total += mean
            origin = bodies.origin()
            wind = 0.0 if constants is None else self._wind_at(origin, constants)
            u1, *torques = robot.wrench(*(mean * self._gains(origin[2])))
            force = bodies.rot[:, 2] * u1
            force += robot.DRAG * (wind - bodies.origin_velocity())
            bodies.kick(GRID, *self._loaded(*self._pushed(force, np.array(torques)), origin))
            if self.cables is not None:
                self._swing(self.cables, constants)
            if noise is not None:
                self._wind = advance(self._keep, self._kick, self._wind, noise[:, step])
            self._step += 1
        self._drift(0.5 * GRID)
        self.wrenches = np.array(robot.wrench(*(total / self._steps)))
        return events

    def _drift(self, duration: float) -> None:
        self.bodies.drift(duration)
        if self.cables is not None:
            self.cables.drift(duration)

    def _swing(self, cables: Cables, constants: Air | None) -> None:
        """Let the loads swing through a step, with the constants of the winds, if there are any."""
        force = np.zeros_like(cables.position)
        for push, at_load in zip(self._pushes, self._at_load, strict=True):
            np.add(force, push, out=force, where=at_load)
        wind = None if constants is None else self._wind_at(cables.position, constants)
        cables.kick(self.bodies, GRID, force, wind)
        self.pulled += GRID * cables.tension

    def _begin_rotors(self, vehicles: NDArray[np.intp], sampled: Sequence[Mapping[str, Any]]) -> None:
        hover = np.array([task.hover_thrusts(own, self._lift) for own in sampled]).T
        self.thrusts[:, vehicles] = hover
        self.wrenches[:, vehicles] = robot.wrench(*hover)
        constants = [own.get("motor_lag", {}).get("time_constant", robot.ROTOR_LAG) for own in sampled]
        self._shares[:, vehicles] = np.array([lag_shares(constant, GRID) for constant in constants]).T
        self._left[:, vehicles] = 1.0
        self._delay[vehicles] = [own.get("action_delay", {}).get("steps", 0) for own in sampled]
        if self._late is None and self._delay[vehicles].any():
            self._late = np.zeros((DELAY_SLOTS, *self.thrusts.shape), self.thrusts.dtype)
        if self._late is not None:
            self._late[..., vehicles] = hover

    def _aims(self, commands: Array) -> Array:
        """Return the rotors' thrust targets (4, n) (N) for a control period that begins with these commands."""
        aims = np.array(robot.thrusts(*commands))
        np.clip(aims, 0.0, robot.MAX_THRUST, out=aims)
        if self._late is None:
            return aims
        period = self._step // self._steps
        self._late[period % DELAY_SLOTS] = aims
        return self._late[(period - self._delay) % DELAY_SLOTS, :, np.arange(aims.shape[1])].T

    def _noise(self) -> Array:
        """Return the noise of the wind for the steps of this control period (4, steps, n)."""
        index = (self._step - self._begun).astype(np.uint64) + np.arange(self._steps, dtype=np.uint64)[:, None]
        return uniform_noise(self._keys, index, self.thrusts.dtype)

    def _wind_at(self, points: Array, constants: Air) -> Array:
        """Return the wind velocity at a point of each vehicle during this step (3, n) (m/s, world axes)."""
        (x, y, z), (ambient_x, ambient_y, ambient_z, turbulence) = points, self._wind
        states = ambient_x, ambient_y, ambient_z, turbulence
        return np.array(velocity(constants, states, (x, y, z), np.exp))

    def _gains(self, height: Array) -> Array | float:
        """Return the gain of each rotor's thrust near the ground (4, n)."""
        if not self._near_ground:
            return 1.0
        heights = np.array(robot.rotor_heights(height, *self.bodies.rot[2, :2]))
        return thrust_gain(heights, robot.ROTOR_RADIUS, self._ground_effect, np.maximum)

    def _pushed(self, force: Array, torque: Array) -> tuple[Array, Array]:
        """Return force and torque with active pushes added."""
        for push, place, at_load in zip(self._pushes, self._places, self._at_load, strict=True):
            acts = push.any(axis=0) & (~at_load | self._carries)
            if acts.any():
                np.add(force, push, out=force, where=acts)
                np.add(torque, cross(place, transposed_times(self.bodies.rot, push)), out=torque, where=acts)
        return force, torque

    def _loaded(self, force: Array, torque: Array, origin: Array) -> tuple[Array, Array]:
        """Return force and torque with effects added."""
        if self._affected:
            load = self._effects.load(self._states(origin))
            if load.force is not None:
                force += load.force.T
            if load.torque is not None:
                torque += transposed_times(self.bodies.rot, load.torque.T)
        return force, torque

    def _states(self, origin: Array) -> RobotStates:
        """Return the current states of all vehicles at known origins; they have no joints."""
        bodies, joints = self.bodies, np.zeros((origin.shape[1], 0))
        spin = times(bodies.rot, bodies.rates)
        parts = (np.ascontiguousarray(part.T) for part in (origin, bodies.quat_xyzw, bodies.origin_velocity(), spin))
        return RobotStates((self._step - self._begun) * GRID, joints, joints, *parts)

    def _push_events(self, vehicle: int, sampled: Mapping[str, Any]) -> list[_Event]:
        """Return the events of the pushes; a push acts for the share of a step that it covers."""
        pushes = [Push.of(entry, PUSH_RESOLUTION) for entry in sampled.get("push", ())]
        missing = len(pushes) - len(self._pushes)
        if missing > 0:
            more = np.zeros((missing, *self._pushes.shape[1:]), self._pushes.dtype)
            self._pushes, self._places = (np.concatenate([slots, more]) for slots in (self._pushes, self._places))
            self._at_load = np.concatenate([self._at_load, np.zeros_like(more[:, 0], np.bool_)])
        self._pushes[..., vehicle], self._at_load[:, vehicle] = 0.0, False
        events: list[_Event] = []
        for slot, push in enumerate(pushes):
            self._at_load[slot, vehicle] = push.site == PAYLOAD
            self._places[slot, :, vehicle] = _SITES.get(push.site) or sampled["payload"]["position"]
            first, last = push.first // PARTS, push.end // PARTS
            for step in sorted({first, first + 1, last, last + 1}):
                covered = min(push.end, (step + 1) * PARTS) - max(push.first, step * PARTS)
                force = np.multiply(push.force, max(0, covered) / PARTS)
                act = partial(self._push, slot, vehicle, force)
                told = (PUSH_BEGINS,) * (step == first) + (PUSH_ENDS,) * (step == last)
                events.append(_Event(step, told, act))
        return events

    def _push(self, slot: int, vehicle: int, force: Array) -> None:
        self._pushes[slot, :, vehicle] = force

    def _loss_events(self, vehicle: int, sampled: Mapping[str, Any]) -> list[_Event]:
        return [
            _Event(
                round(loss["start"] / GRID),
                (),
                partial(self._lose, vehicle, robot.ROTORS.index(loss["joint"]), loss["factor"]),
            )
            for loss in sampled.get("actuator_effectiveness", ())
        ]

    def _lose(self, vehicle: int, rotor: int, factor: float) -> None:
        self._left[rotor, vehicle] *= factor

    def _happen(self, told: dict[int, list[str]]) -> None:
        """Run due events and record their names in `told`."""
        for vehicle in np.flatnonzero(self._due <= self._step).tolist():
            agenda = self._agenda[vehicle]
            while agenda and self._begun[vehicle] + agenda[-1].step <= self._step:
                event = agenda.pop()
                event.act()
                if event.told:
                    told.setdefault(vehicle, []).extend(event.told)
            self._await(vehicle)

    def _await(self, vehicle: int) -> None:
        self._set_due(vehicle)
        self._soonest = self._due.min()

    def _set_due(self, vehicle: int) -> None:
        agenda = self._agenda[vehicle]
        self._due[vehicle] = self._begun[vehicle] + agenda[-1].step if agenda else NEVER


def _is_carried(payload: Mapping[str, Any]) -> bool:
    """Return True if a payload is attached before it is dropped."""
    return payload["detach_time"] > payload["attach_time"]


def _balls(payloads: Sequence[Mapping[str, Any]]) -> MassProperties:
    """Return the mass properties of payloads, one in each row."""
    mass = np.array([payload["mass"] for payload in payloads])
    moment = 0.4 * mass * PAYLOAD_RADIUS**2
    return MassProperties(
        mass, np.array([payload["position"] for payload in payloads]), moment[:, None, None] * np.eye(3)
    )


def _one(properties: MassProperties, row: int) -> MassProperties:
    return MassProperties(*(part[row] for part in properties))


def _some(properties: MassProperties, rows: list[int]) -> MassProperties:
    return MassProperties(*(part[rows] for part in properties))
