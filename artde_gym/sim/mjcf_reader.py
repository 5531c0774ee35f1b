"""MJCF files of users as trees of links, compiled by MuJoCo without their meshes.

Whatever reaches outside the file or multiplies its bodies is refused before MuJoCo parses it.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from artde_gym.errors import RobotError
from artde_gym.multibody.model_file import FileJoint, FileLink, ModelTree, check_links, check_name
from artde_gym.sim.mujoco_module import mj

REFUSED = ("attach", "composite", "extension", "flex", "flexcomp", "include", "model", "plugin", "replicate", "skin")
"""Elements that read other files, load code or multiply bodies."""
_OF_JOINT = [int(kind) for kind in (mj.mjtTrn.mjTRN_JOINT, mj.mjtTrn.mjTRN_JOINTINPARENT)]


def read_mjcf(root: ET.Element, text: str, file: str) -> ModelTree:
    """Convert a `<mujoco>`.

    Raises:
        RobotError: for anything that is broken or not a tree of links on hinges and slides; it names file, element and
            what is allowed.
    """
    for element in root.iter():
        if element.tag in REFUSED:
            raise RobotError(f"element of {file}", f"<{element.tag}>", f"any but {', '.join(REFUSED)}: flatten it")
    check_links(sum(1 for _ in root.iter("body")), file)
    return _Reader(_compiled(text, file), file).tree()


def _compiled(text: str, file: str) -> Any:
    try:
        spec = mj.MjSpec.from_string(text)
        spec.compiler.fusestatic = False
        spec.compiler.discardvisual = False
        _drop_meshes(spec, file)
        return spec.compile()
    except RobotError:
        raise
    except Exception as error:  # of MuJoCo's parser and compiler: ValueError, but also others
        message = " ".join(str(error).split())
        raise RobotError("model", file, f"MJCF that MuJoCo compiles without meshes ({message})") from error


def _drop_meshes(spec: Any, file: str) -> None:
    """Delete everything that reads a file, unless it decides an inertia."""
    for geom in list(spec.geoms):
        if geom.type in (mj.mjtGeom.mjGEOM_MESH, mj.mjtGeom.mjGEOM_HFIELD, mj.mjtGeom.mjGEOM_SDF) or geom.meshname:
            _check_inertial(spec, geom, file)
            spec.delete(geom)
    for pair in list(spec.pairs) + list(spec.excludes):
        spec.delete(pair)
    for parts in (spec.meshes, spec.materials, spec.textures, spec.hfields):
        for part in list(parts):
            spec.delete(part)


def _check_inertial(spec: Any, geom: Any, file: str) -> None:
    body = geom.parent
    if body.name == "world" or geom.mass == 0 or (geom.density == 0 and math.isnan(geom.mass)):
        return
    always = spec.compiler.inertiafromgeom == mj.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    if always or not body.explicitinertial:
        allowed = "an <inertial>, as meshes are not read (and no inertiafromgeom='true')"
        raise RobotError(f"inertia of body {body.name!r} in {file}", "that of a mesh", allowed)


class _Reader:
    """Conversion of a compiled model."""

    def __init__(self, model: Any, file: str) -> None:
        self._model, self._file = model, file
        self._check_constraints()
        self._follows = self._coupled()

    def tree(self) -> ModelTree:
        """Convert all bodies; those without a name are called by their number."""
        model = self._model
        check_links(model.nbody - 1, self._file)
        names = ["world", *(self._name(mj.mjtObj.mjOBJ_BODY, body) for body in range(1, model.nbody))]
        links = [FileLink("world", None, np.zeros(3), np.eye(3), 0.0, np.zeros(3), np.zeros((3, 3)))]
        shift = np.zeros((model.nbody, 3))  # of a joint's anchor from its body's origin
        for body in range(1, model.nbody):
            joint, shift[body] = self._joint(body, names[body])
            parent, rotation = int(model.body_parentid[body]), _matrix(model.body_quat[body])
            principal = _matrix(model.body_iquat[body])
            if model.body_gravcomp[body]:
                raise self._error(f"gravcomp of body {names[body]!r}", float(model.body_gravcomp[body]), "0")
            links.append(
                FileLink(
                    names[body],
                    names[parent],
                    model.body_pos[body] - shift[parent] + rotation @ shift[body],
                    rotation,
                    float(model.body_mass[body]),
                    model.body_ipos[body] - shift[body],
                    principal @ np.diag(model.body_inertia[body]) @ principal.T,
                    joint,
                )
            )
        return ModelTree(self._file, tuple(links))

    def _joint(self, body: int, name: str) -> tuple[FileJoint | None, np.ndarray]:
        model, count, j = self._model, int(self._model.body_jntnum[body]), int(self._model.body_jntadr[body])
        if count == 0:
            return None, np.zeros(3)
        if count > 1:
            raise self._error(f"joints of body {name!r}", count, "at most one; put a body between two")
        own = check_name("joint", self._name(mj.mjtObj.mjOBJ_JOINT, j), self._file)
        kind = mj.mjtJoint(int(model.jnt_type[j]))
        if kind not in (mj.mjtJoint.mjJNT_HINGE, mj.mjtJoint.mjJNT_SLIDE):
            word = kind.name.removeprefix("mjJNT_").lower()
            raise self._error(f"type of joint {own!r}", word, "hinge, slide: a fixed base and one degree of freedom")
        dof = int(model.jnt_dofadr[j])
        if np.any(model.jnt_stiffness[j]):
            raise self._error(f"stiffness of joint {own!r}", model.jnt_stiffness[j].tolist(), "0: no springs")
        if model.qpos0[model.jnt_qposadr[j]] != 0:
            raise self._error(f"ref of joint {own!r}", float(model.qpos0[model.jnt_qposadr[j]]), "0")
        low, high = model.jnt_range[j].tolist() if model.jnt_limited[j] else (-math.inf, math.inf)
        joint = FileJoint(
            own,
            model.jnt_axis[j].copy(),
            kind == mj.mjtJoint.mjJNT_SLIDE,
            (low, high),
            self._effort(j),
            damping=self._linear("damping", own, model.dof_damping[dof]),
            coulomb=self._not_negative("frictionloss", own, model.dof_frictionloss[dof]),
            armature=self._not_negative("armature", own, model.dof_armature[dof]),
            follows=self._follows.get(j, ""),
        )
        return joint, model.jnt_pos[j].copy()

    def _linear(self, what: str, joint: str, values: Any) -> float:
        """Return the linear coefficient of what MuJoCo allows to be a polynomial."""
        first, *others = np.ravel(values).tolist()
        if any(others):
            raise self._error(f"{what} of joint {joint!r}", np.ravel(values).tolist(), "one number")
        return self._not_negative(what, joint, first)

    def _not_negative(self, what: str, joint: str, value: Any) -> float:
        if not value >= 0:
            raise self._error(f"{what} of joint {joint!r}", float(value), "a number >= 0")
        return float(value)

    def _effort(self, joint: int) -> float:
        """Return the largest force that a joint can have in both directions, as the joint or an actuator limits it."""
        model = self._model
        bounds = [model.jnt_actfrcrange[joint]] if model.jnt_actfrclimited[joint] else []
        for i in range(model.nu):
            if model.actuator_trntype[i] in _OF_JOINT and model.actuator_trnid[i, 0] == joint:
                gear = float(model.actuator_gear[i, 0])
                if model.actuator_forcelimited[i]:
                    bounds.append(gear * model.actuator_forcerange[i])
                if model.actuator_ctrllimited[i] and self._is_motor(i):
                    bounds.append(gear * model.actuator_gainprm[i, 0] * model.actuator_ctrlrange[i])
        return min((min(-float(min(one)), float(max(one))) for one in bounds), default=math.inf)

    def _is_motor(self, actuator: int) -> bool:
        """Return True if an actuator's force is its control times a constant."""
        model = self._model
        kinds = (model.actuator_dyntype, model.actuator_gaintype, model.actuator_biastype)
        return [int(kind[actuator]) for kind in kinds] == [
            mj.mjtDyn.mjDYN_NONE,
            mj.mjtGain.mjGAIN_FIXED,
            mj.mjtBias.mjBIAS_NONE,
        ]

    def _check_constraints(self) -> None:
        model = self._model
        for i in range(model.neq):
            kind = mj.mjtEq(int(model.eq_type[i]))
            if model.eq_active0[i] and kind != mj.mjtEq.mjEQ_JOINT:
                word = kind.name.removeprefix("mjEQ_").lower()
                raise self._error("equality constraint", word, "joint: bodies make a tree, without loops")
        for tendon in range(model.ntendon):
            first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
            if any(model.wrap_type[first : first + count] != mj.mjtWrap.mjWRAP_JOINT):
                name = self._name(mj.mjtObj.mjOBJ_TENDON, tendon)
                raise self._error("spatial tendon", name, "none: forces act on joints")

    def _coupled(self) -> dict[int, str]:
        """Return joints that an equality or a fixed tendon couples to others, and why."""
        model, coupled = self._model, {}
        for i in range(model.neq):
            if model.eq_active0[i]:
                for joint in (int(model.eq_obj1id[i]), int(model.eq_obj2id[i])):
                    coupled[joint] = "an equality couples it"
        for tendon in range(model.ntendon):
            first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
            for joint in model.wrap_objid[first : first + count].tolist():
                coupled[joint] = "a tendon moves it"
        return coupled

    def _name(self, kind: Any, number: int) -> str:
        return mj.mj_id2name(self._model, kind, number) or f"#{number}"

    def _error(self, what: str, value: object, allowed: str) -> RobotError:
        return RobotError(f"{what} in {self._file}", value, allowed)


def _matrix(quat: np.ndarray) -> np.ndarray:
    out = np.zeros(9)
    mj.mju_quat2Mat(out, np.asarray(quat, np.float64))
    return out.reshape(3, 3)
