"""Named scenarios: an environment, its arguments and what happens in it, fixed on physical grounds.

Every scenario varies from seed to seed, so that a result is a rate and not a single trajectory. Biped: a kick on the
torso of 0.5 to 5 N for 0.2 s at 1 s from any side, friction of 0.7 to 0.9, and a payload up to 1 cm off its place.
Quadrotor: the air, a payload within 5 % of its mass and 5 mm of its place (as it is weighed and gripped), and a start
within 5 mm of the path (as a vehicle hovers there).

The thesis applies a ground reaction force in all of its scenarios; S1 to S3 leave it out. S1-GRF33 to S3-GRF50 add it,
a double hump of 1 s from each landing, of 33, 45 or 50 % of the weight of the robot as specified. The 45 % are fitted:
where the thesis' pattern of falls appears in MuJoCo; not confirmed in Bullet. 33 and 50 % lie on either side.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from artde_gym.disturbances.pushes import ARM_PUSH, CHEST_PUSH
from artde_gym.errors import UnknownNameError, among

_KICK = {
    "body": "torso",
    "magnitude": {"uniform": [0.5, 5.0]},
    "direction": [{"normal": [0.0, 1.0]}, {"normal": [0.0, 1.0]}, 0.0],
    "start": 1.0,
    "duration": 0.2,
}
_VARIATION: dict[str, Any] = {"push": [_KICK], "friction": {"uniform": [0.7, 0.9]}}
_PAYLOAD: dict[str, Any] = {
    "mass": 1.3,
    "position": [{"uniform": [-0.01, 0.01]}, {"uniform": [-0.01, 0.01]}, {"uniform": [0.15, 0.17]}],
}


@dataclasses.dataclass(frozen=True)
class Scenario:
    """One entry.

    Attributes:
        thesis: the thesis' scenario that it stands beside, if any.
        phases: (start, end) (s) of parts that are measured one by one too.
    """

    name: str
    env_id: str
    kwargs: Mapping[str, Any]
    disturbances: Mapping[str, Any]
    text: str
    thesis: str | None = None
    phases: tuple[tuple[float, float], ...] = ()


_LOAD: dict[str, Any] = {
    "mass": {"uniform": [0.95 * 0.35, 1.05 * 0.35]},
    "position": [{"uniform": [0.005, 0.015]}, {"uniform": [-0.005, 0.005]}, {"uniform": [-0.105, -0.095]}],
    "drop": 35.0,
}
_FLIGHT: dict[str, Any] = {
    "payload": _LOAD,
    "ground_effect": 1.0,
    "initial_position": {"offset": [{"uniform": [-0.005, 0.005]}] * 3},
}

_WALK = "BipedWalk-Payload-v0"
_PUSH = "BipedPush-v0"
_INFINITY = "QuadInfinity-Payload-v0"
_SLOW = {"control_period": 0.004}
_S2 = {"payload": _PAYLOAD, **_VARIATION}
_S3 = {**_S2, "push": [_KICK, CHEST_PUSH, ARM_PUSH]}
_PHASES = ((0.0, 28.0), (28.0, 37.0), (37.0, math.inf))
_LEFT_OUT = "leaves the thesis' ground force out"
_PUSHES = f"walk with a payload, pushes of 10 N at 28 s (chest) and 37 s (left arm); {_LEFT_OUT}"
_FITTED = "; fitted: where the pattern appears in MuJoCo; not confirmed in Bullet"


def _with_ground_force(name: str, percent: int) -> Scenario:
    """S1, S2 or S3 with the thesis' ground force, of a size in percent of the weight."""
    env_id, disturbances, phases = {"S1": (_WALK, _VARIATION, ()), "S2": (_WALK, _S2, ()), "S3": (_PUSH, _S3, _PHASES)}[
        name
    ]
    pulse = {"shape": "double_hump", "share": percent / 100, "duration": 1.0, "trigger": "contact"}
    text = f"{name} with the thesis' ground force, {percent} % of the weight" + (_FITTED if percent == 45 else "")
    return Scenario(f"{name}-GRF{percent}", env_id, {}, {**disturbances, "grf_pulse": pulse}, text, name, phases)


SCENARIOS: dict[str, Scenario] = {
    entry.name: entry
    for entry in (
        Scenario("S1", _WALK, {}, _VARIATION, f"walk without payload, L = 1 ms; {_LEFT_OUT}", "S1"),
        Scenario("S2", _WALK, {}, _S2, f"walk with a payload of 1.3 kg, L = 1 ms; {_LEFT_OUT}", "S2"),
        Scenario("S3", _PUSH, {}, _S3, _PUSHES, "S3", _PHASES),
        Scenario("S1-L4", _WALK, _SLOW, _VARIATION, "S1 at L = 4 ms: a quarter of the joint stiffness", "S1"),
        Scenario("S2-L4", _WALK, _SLOW, _S2, "S2 at L = 4 ms", "S2"),
        Scenario("S3-L4", _PUSH, _SLOW, _S3, "S3 at L = 4 ms", "S3", _PHASES),
        *(_with_ground_force(name, percent) for name in ("S1", "S2", "S3") for percent in (33, 45, 50)),
        Scenario("Q1", _INFINITY, {}, {**_FLIGHT, "wind": 1.0}, "infinity loops with a payload of 0.35 kg, wind", "Q1"),
        Scenario("Q1-calm", _INFINITY, {}, _FLIGHT, "Q1 without wind"),
        Scenario("Q1-gale", _INFINITY, {}, {**_FLIGHT, "wind": 2.0}, "Q1 in wind of twice the strength", "Q1"),
    )
}


def scenario(name: str) -> Scenario:
    """The scenario called `name`.

    Raises:
        UnknownNameError: if there is none.
    """
    if not isinstance(name, str) or name not in SCENARIOS:
        raise UnknownNameError("scenario", name, among(name, SCENARIOS))
    return SCENARIOS[name]
