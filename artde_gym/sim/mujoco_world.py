"""Properties of one world in MuJoCo: masses, payload, friction, gravity and forces.

A world is either a model or one row of a batch's fields; both are read and set in the same way here.
"""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.errors import RobotError
from artde_gym.multibody.mjcf import CONTACT_TIME, PAYLOAD, mjcf
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.sim.engine import PAYLOAD_RADIUS
from artde_gym.sim.mujoco_module import mj

STATE = mj.mjtState.mjSTATE_INTEGRATION  # everything that the next step depends on
FIELDS = ("body_mass", "body_inertia", "body_pos", "dof_armature", "pair_friction", "pair_solref", "opt.gravity")
"""Fields of MuJoCo's model that differ between worlds; `masses_changed` updates the ones derived from them."""


class Blueprint:
    """The model of a robot on a plane, with the indices of its parts.

    Raises:
        RobotError: for a robot whose rotors are links.
    """

    def __init__(self, spec: RobotSpec, time_step: float) -> None:
        if spec.gears:
            raise RobotError(
                "gears", spec.gears, "use rotors as armature, or engine 'bullet'", "cannot be coupled here"
            )
        self.spec = spec
        self.model = model = mj.MjModel.from_xml_string(mjcf(spec, visuals=False))
        model.opt.timestep = time_step
        self.bodies = [model.body(link.name).id for link in spec.links]
        self.base = self.bodies[0]
        self.feet = [model.body(name).id for name in spec.feet]
        self.payload = model.body(PAYLOAD).id
        self.sites = {name: model.site(name).id for name, _, _ in spec.sites}
        # MuJoCo orders coordinates as those of a free base, then the joints' in the order of the tree
        self.base_q, self.base_v = (0, 0) if spec.fixed else (7, 6)
        self.joints = _span([int(model.joint(name).dofadr[0]) - self.base_v for name in spec.actuated])
        self.mass, self.inertia = model.body_mass.copy(), model.body_inertia.copy()
        self.armature = model.dof_armature.copy()

    def site(self, name: str) -> int:
        """Return the index of a site.

        Raises:
            RobotError: if there is none of this name.
        """
        if name not in self.sites:
            raise RobotError("site", name, ", ".join(map(repr, self.sites)))
        return self.sites[name]


class Fields(NamedTuple):
    """`FIELDS` of one world, and `pushes`, its applied forces and torques at the centers of mass (bodies, 6)."""

    body_mass: Array
    body_inertia: Array
    body_pos: Array
    dof_armature: Array
    pair_friction: Array
    pair_solref: Array
    gravity: Array
    pushes: Array


class MujocoWorld(abc.ABC):
    """A world with the protocol `artde_gym.sim.engine.World`."""

    def __init__(self, blueprint: Blueprint, fields: Fields) -> None:
        self.spec = blueprint.spec
        self.held: Vector | None = None  # position of the payload on the base
        self._blueprint, self._fields = blueprint, fields
        self._scales: tuple[float, dict[str, float], float] = (1.0, {}, 1.0)

    @abc.abstractmethod
    def placed(self) -> Any:
        """Return MuJoCo's data with current positions of bodies and sites."""

    @abc.abstractmethod
    def masses_changed(self) -> None:
        """Update the solver's constants that depend on masses."""

    @abc.abstractmethod
    def foot_loads(self) -> tuple[float, ...]: ...

    def apply_force(self, site: str, force: Vector) -> None:
        number, data = self._blueprint.site(site), self.placed()
        body = self._blueprint.model.site_bodyid[number]
        arm = data.site_xpos[number] - data.xipos[body]
        self.add_force(body, force, np.cross(arm, force))

    def apply_world_wrench(self, force: Vector, torque: Vector) -> None:
        """See `artde_gym.sim.engine.World`."""
        self.add_force(self._blueprint.base, force, torque)

    def lift_feet(self, forces: Sequence[float]) -> None:
        """See `artde_gym.sim.engine.World`."""
        for foot, force in zip(self._blueprint.feet, forces, strict=True):
            self.add_force(foot, (0.0, 0.0, force), (0.0, 0.0, 0.0))

    def site(self, name: str) -> Vector:
        """See `artde_gym.sim.engine.Engine`."""
        number = self._blueprint.site(name)
        x, y, z = self.placed().site_xpos[number].tolist()
        return x, y, z

    def add_force(self, body: int, force: Vector, torque: Vector | NDArray[Any]) -> None:
        """Add a force and a torque (world axes) at a body's center of mass, for the next step only."""
        pushes = self._fields.pushes[body]  # a view
        pushes += (*force, *torque)

    def set_friction(self, coefficient: float) -> None:
        self._fields.pair_friction[:, :2] = coefficient

    def set_gravity(self, gravity: Vector) -> None:
        self._fields.gravity[:] = gravity

    def set_contact_time(self, time: float | None) -> None:
        self._fields.pair_solref[:, 0] = CONTACT_TIME if time is None else time

    def scale_masses(
        self, factor: float, links: Mapping[str, float] = MappingProxyType({}), armature: float = 1.0
    ) -> None:
        scales = (factor, dict(links), armature)
        if scales == self._scales:
            return
        self._scales = scales
        nominal, fields = self._blueprint, self._fields
        each = np.array([factor * links.get(link.name, 1.0) for link in self.spec.links])
        fields.body_mass[nominal.bodies] = each * nominal.mass[nominal.bodies]
        fields.body_inertia[nominal.bodies] = each[:, None] * nominal.inertia[nominal.bodies]
        fields.dof_armature[:] = (factor * armature) * nominal.armature
        self.masses_changed()

    def settings(self) -> dict[str, Any]:
        """Return this world's differences from the blueprint, for `set_up`."""
        fields = self._fields
        mass = float(fields.body_mass[self._blueprint.payload])
        friction, gravity = fields.pair_friction.copy(), fields.gravity.copy()
        solref = fields.pair_solref.copy()
        return {
            "scales": self._scales,
            "payload": (mass, self.held),
            "friction": friction,
            "gravity": gravity,
            "solref": solref,
        }

    def set_up(self, settings: dict[str, Any]) -> None:
        """Apply the settings of another world."""
        self.scale_masses(*settings["scales"])
        mass, place = settings["payload"]
        if place is not None:
            MujocoWorld.attach_payload(self, mass, place)
        self._fields.pair_friction[:] = settings["friction"]
        self._fields.gravity[:] = settings["gravity"]
        self._fields.pair_solref[:] = settings["solref"]

    def attach_payload(self, mass: float, position: Vector) -> None:
        self.held = position
        self._fields.body_pos[self._blueprint.payload] = position
        self._weigh_payload(mass)

    def release_payload(self) -> None:
        if self.held is not None:
            self.held = None
            self._weigh_payload(0.0)

    def _weigh_payload(self, mass: float) -> None:
        payload = self._blueprint.payload
        self._fields.body_mass[payload] = mass
        self._fields.body_inertia[payload] = 0.4 * mass * PAYLOAD_RADIUS**2
        self.masses_changed()


def _span(numbers: list[int]) -> slice | list[int]:
    """Return consecutive numbers as a slice, which makes indexing faster."""
    first = numbers[0] if numbers else 0
    return slice(first, first + len(numbers)) if numbers == list(range(first, first + len(numbers))) else numbers
