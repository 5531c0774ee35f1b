"""The grammar of disturbances: what it accepts, what it draws, and how it refuses."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from artde_gym.disturbances import DISTURBANCES, Disturbances
from artde_gym.disturbances.kinds import ROBOTS, DisturbanceSpec, Parameter, page
from artde_gym.errors import DisturbanceError

SITES = ("torso", "chest", "left_arm", "right_arm")
JOINTS = ("left_knee", "right_knee")


def parse(given: Any) -> Disturbances:
    return Disturbances.parse(given, SITES, JOINTS)


def draw(given: Any, seed: int = 0) -> dict[str, Any]:
    return parse(given).sample(np.random.default_rng(seed))


# --------------------------------------------------------------------------------------------------- valid disturbances


def words(parameter: Parameter) -> tuple[str, ...]:
    if isinstance(parameter.choices, str):
        return {"site": SITES, "joint": (*JOINTS, "all")}[parameter.choices]
    return parameter.choices


def inside(parameter: Parameter) -> st.SearchStrategy[float]:
    if parameter.integer:
        return st.integers(int(parameter.low), int(parameter.high))
    return st.floats(parameter.low, parameter.high)


def component(parameter: Parameter) -> st.SearchStrategy[Any]:
    """A number or a distribution of numbers."""
    number = inside(parameter)
    return st.one_of(
        number,
        st.tuples(number, number).map(lambda pair: {"uniform": sorted(pair)}),
        st.tuples(number, st.floats(0.0, 1e3)).map(lambda pair: {"normal": list(pair)}),
        st.lists(number, min_size=1, max_size=4).map(lambda items: {"choice": items}),
    )


def may_be_nonzero(value: Any) -> bool:
    """Whether a vector, or each one to choose from, has a component that is not always zero."""
    if isinstance(value, dict):
        return all(map(may_be_nonzero, value["choice"]))
    return any(any(next(iter(item.values()))) if isinstance(item, dict) else item for item in value)


def values(parameter: Parameter) -> st.SearchStrategy[Any]:
    if parameter.size == 0:
        return st.sampled_from(words(parameter))
    if parameter.size == 1:
        return component(parameter)
    vectors = st.lists(component(parameter), min_size=parameter.size, max_size=parameter.size)
    choices = st.lists(vectors, min_size=1, max_size=3).map(lambda items: {"choice": items})
    either = vectors | choices
    return either.filter(may_be_nonzero) if parameter.nonzero else either


def entry(kind: DisturbanceSpec) -> st.SearchStrategy[dict[str, Any]]:
    def one(chosen: str) -> st.SearchStrategy[dict[str, Any]]:
        required = {p.name: values(p) for p in complete(kind, chosen) if p.default is None}
        optional = {p.name: values(p) for p in kind.parameters if p.default is not None}
        return st.fixed_dictionaries(required, optional=optional)

    return st.sampled_from(kind.one_of or ("",)).flatmap(one)


def complete(kind: DisturbanceSpec, chosen: str = "") -> list[Parameter]:
    """The parameters of a whole entry, with the chosen one of those that exclude each other, or the first."""
    kept = chosen if chosen in kind.one_of else "".join(kind.one_of[:1])
    return [p for p in kind.parameters if p.name not in kind.one_of or p.name == kept]


def whole(kind: DisturbanceSpec) -> st.SearchStrategy[Any]:
    if kind.multiple:
        return entry(kind) | st.lists(entry(kind), max_size=3)
    if kind.shorthand is None:
        return entry(kind)
    scalar = next(p for p in kind.parameters if p.name == kind.shorthand)
    return entry(kind) | component(scalar)


valid = st.fixed_dictionaries({}, optional={name: whole(kind) for name, kind in DISTURBANCES.items()})


def check_realised(sampled: dict[str, Any]) -> None:
    """All values of the kinds that were drawn are plain, complete and allowed."""
    for name, entries in sampled.items():
        for entry in entries if DISTURBANCES[name].multiple else [entries]:
            chosen = next((one for one in DISTURBANCES[name].one_of if one in entry), "")
            assert entry.keys() == {parameter.name for parameter in complete(DISTURBANCES[name], chosen)}
            for parameter in complete(DISTURBANCES[name], chosen):
                check_value(parameter, entry[parameter.name])


def check_value(parameter: Parameter, value: Any) -> None:
    if parameter.size == 0:
        assert value in words(parameter)
        assert value != "all"  # stands for one entry a joint
        return
    components = value if parameter.size > 1 else [value]
    assert len(components) == parameter.size
    for number in components:
        assert type(number) is (int if parameter.integer else float)
        assert parameter.low <= number <= parameter.high
    assert any(components) or not parameter.nonzero


@given(given_=valid, seed=st.integers(0, 2**32 - 1))
def test_draws_are_plain_numbers_in_range_that_parse_back(given_, seed):
    sampled = draw(given_, seed)
    check_realised(sampled)
    assert draw(json.loads(json.dumps(sampled)), seed + 1) == sampled


@given(given_=valid, seed=st.integers(0, 2**32 - 1))
def test_json_round_trip(given_, seed):
    once = parse(given_)
    again = parse(json.loads(once.to_json()))
    assert again == once
    assert again.sample(np.random.default_rng(seed)) == once.sample(np.random.default_rng(seed))


def backwards(value: Any) -> Any:
    """The same disturbances with all keys in the opposite order; lists keep theirs."""
    if isinstance(value, dict):
        return {key: backwards(item) for key, item in reversed(list(value.items()))}
    return [backwards(item) for item in value] if isinstance(value, list) else value


@given(given_=valid, seed=st.integers(0, 2**32 - 1))
def test_the_same_seed_draws_the_same_whatever_the_order_of_keys(given_, seed):
    sampled = draw(given_, seed)
    assert draw(given_, seed) == sampled
    assert draw(backwards(given_), seed) == sampled


def test_short_forms():
    assert draw({"payload": 1.3}) == draw({"payload": {"mass": 1.3}})
    assert draw({"payload": 1.3})["payload"]["position"] == [0.0, 0.0, 0.16]
    push = {"magnitude": 10, "start": 28}
    full = {"body": "torso", "magnitude": 10.0, "direction": [1.0, 0.0, 0.0], "start": 28.0, "duration": 0.2}
    assert draw({"push": push}) == draw({"push": [push]}) == {"push": [full]}
    assert draw({"friction": {"choice": [0.5]}}) == {"friction": {"coefficient": 0.5}}
    assert draw({}) == draw(None) == {}


def test_numpy_values_are_accepted():
    numbers = {
        "payload": {"mass": np.float32(1.5), "position": np.array([0.0, 0.25, 0.5])},
        "friction": {"uniform": np.array([0.5, 0.5])},
        "push": ({"magnitude": np.int64(3), "start": np.float64(1.0), "direction": {"choice": np.eye(3)[:1]}},),
    }
    sampled = draw(numbers)
    assert sampled["payload"]["mass"] == 1.5
    assert sampled["payload"]["position"] == [0.0, 0.25, 0.5]
    assert sampled["friction"] == {"coefficient": 0.5}
    assert sampled["push"][0]["direction"] == [1.0, 0.0, 0.0]
    json.dumps(sampled)
    json.loads(parse(numbers).to_json())


# -------------------------------------------------------------------------------------------------------- distributions


def sample(value: Any, count: int = 4000) -> np.ndarray:
    rng, disturbances = np.random.default_rng(16), parse({"payload": {"mass": 1.0, "position": value}})
    return np.array([disturbances.sample(rng)["payload"]["position"] for _ in range(count)])


@pytest.mark.once
def test_uniform_and_choice_have_their_moments():
    x, y, z = sample([{"uniform": [-0.1, 0.3]}, {"choice": [0.0, 0.2]}, {"normal": [0.1, 0.05]}]).T
    for drawn, mean, std in [(x, 0.1, 0.4 / math.sqrt(12)), (y, 0.1, 0.1), (z, 0.1, 0.05)]:
        assert abs(drawn.mean() - mean) < 4 * std / math.sqrt(len(drawn))
        assert drawn.std() == pytest.approx(std, rel=0.05)
    assert np.abs(np.corrcoef([x, y, z]) - np.eye(3)).max() < 0.06


@pytest.mark.once
def test_normal_is_drawn_again_until_in_range():
    drawn = sample([{"normal": [0.5, 0.2]}, 0.0, 0.0])[:, 0]  # half of it lies beyond the range
    assert drawn.max() <= 0.5
    assert drawn.mean() == pytest.approx(0.5 - 0.2 * math.sqrt(2 / math.pi), abs=0.01)  # of a half-normal


SCALARS = [(kind.name, p) for kind in DISTURBANCES.values() for p in kind.parameters if p.name == kind.shorthand]


@pytest.mark.parametrize(("kind", "parameter"), SCALARS, ids=lambda value: getattr(value, "name", value))
def test_a_normal_that_misses_its_range_gives_its_mean(kind, parameter):
    mean = math.ceil(parameter.low) if parameter.integer else parameter.low
    sampled = draw({kind: {"normal": [mean, 1e308]}})
    check_realised(sampled)
    assert sampled[kind][parameter.name] == mean


def test_choice_takes_vectors_and_distributions_within_them():
    x, y, z = sample({"choice": [[0.1, 0.2, 0.3], [-0.1, -0.2, {"uniform": [-0.4, -0.3]}]]}).T
    np.testing.assert_allclose(y, 2 * x)
    assert set(z[x > 0]) == {0.3}
    assert np.ptp(z[x < 0]) > 0.09
    assert 0.45 < (x > 0).mean() < 0.55


@pytest.mark.once
def test_normal_components_make_an_isotropic_planar_direction():
    normal = {"normal": [0, 1]}
    rng = np.random.default_rng(17)
    disturbances = parse({"push": [{"magnitude": 1, "start": 0, "direction": [normal, normal, 0]}]})
    drawn = np.array([disturbances.sample(rng)["push"][0]["direction"] for _ in range(8000)])
    assert np.all(drawn[:, 2] == 0)
    heading = np.arctan2(drawn[:, 1], drawn[:, 0])
    counts, _ = np.histogram(heading, bins=16, range=(-math.pi, math.pi))
    chi_squared = ((counts - 500) ** 2 / 500).sum()
    assert chi_squared < 37.7  # 0.1 % of chi^2 with 15 degrees of freedom
    assert np.hypot(np.cos(heading).mean(), np.sin(heading).mean()) < 0.03


# ------------------------------------------------------------------------------------------------------------- refusals

PUSH = {"magnitude": 10.0, "start": 1.0}
WRONG: list[tuple[Any, str, Any]] = [  # what is given, the field and the value that the message must name
    ([], "disturbances", []),
    ("payload", "disturbances", "payload"),
    ({"payloads": 1.0}, "disturbances", "payloads"),
    ({1: 1.0}, "disturbances", 1),
    ({"payload": -1.0}, "payload.mass", -1.0),
    ({"payload": 0}, "payload.mass", 0),
    ({"payload": 5.5}, "payload.mass", 5.5),
    ({"payload": math.nan}, "payload.mass", math.nan),
    ({"payload": math.inf}, "payload.mass", math.inf),
    ({"payload": 10**400}, "payload.mass", 10**400),
    ({"payload": {"mass": np.array(1.3)}}, "payload.mass", np.array(1.3)),
    ({"payload": {"mass": 1.3, "position": np.array(0.1)}}, "payload.position", np.array(0.1)),
    ({"payload": "1.3"}, "payload", "1.3"),
    ({"payload": True}, "payload", True),
    ({"payload": None}, "payload", None),
    ({"payload": {}}, "payload.mass", None),
    ({"payload": {"mass": True}}, "payload.mass", True),
    ({"payload": {"mass": [1.3]}}, "payload.mass", [1.3]),
    ({"payload": {"mass": 1.3, "masss": 1.3}}, "payload key", "masss"),
    ({"payload": {"mass": 1.3, "position": 0.1}}, "payload.position", 0.1),
    ({"payload": {"mass": 1.3, "position": [0.1, 0.1]}}, "payload.position", [0.1, 0.1]),
    ({"payload": {"mass": 1.3, "position": [0.0, 0.6, 0.0]}}, "payload.position[1]", 0.6),
    ({"payload": {"mass": 1.3, "position": [0.0, "x", 0.0]}}, "payload.position[1]", "x"),
    ({"payload": {"mass": 1.3, "position": [[0.0], [0.0], [0.0]]}}, "payload.position[0]", [0.0]),
    ({"payload": {"mass": 1.3, "position": None}}, "payload.position", None),
    ({"payload": {"mass": 1.3, "position": {"uniform": [0.0, 0.1]}}}, "payload.position", {"uniform": [0.0, 0.1]}),
    ({"payload": {"mass": {"uniform": [2.0, 1.0]}}}, "payload.mass.uniform", [2.0, 1.0]),
    ({"payload": {"mass": {"uniform": [1.0]}}}, "payload.mass.uniform", [1.0]),
    ({"payload": {"mass": {"uniform": 1.0}}}, "payload.mass.uniform", 1.0),
    ({"payload": {"mass": {"uniform": [1.0, 9.0]}}}, "payload.mass.uniform[1]", 9.0),
    ({"payload": {"mass": {"normal": [9.0, 1.0]}}}, "payload.mass.normal[0]", 9.0),
    ({"payload": {"mass": {"normal": [1.0, -1.0]}}}, "payload.mass.normal[1]", -1.0),
    ({"payload": {"mass": {"normal": [1.0, math.inf]}}}, "payload.mass.normal[1]", math.inf),
    ({"payload": {"mass": {"normal": [1.0, 10**400]}}}, "payload.mass.normal[1]", 10**400),
    ({"payload": {"mass": {"choice": []}}}, "payload.mass.choice", []),
    ({"payload": {"mass": {"choice": [1.0, 9.0]}}}, "payload.mass.choice[1]", 9.0),
    ({"payload": {"mass": {"choice": [{"uniform": [1.0, 2.0]}]}}}, "payload.mass.choice[0]", {"uniform": [1.0, 2.0]}),
    ({"payload": {"mass": {"unifrom": [1.0, 2.0]}}}, "payload.mass", {"unifrom": [1.0, 2.0]}),
    ({"push": 10.0}, "push", 10.0),
    ({"push": [10.0]}, "push[0]", 10.0),
    ({"push": [PUSH, {"magnitude": 10.0}]}, "push[1].start", None),
    ({"push": {**PUSH, "body": "tail"}}, "push[0].body", "tail"),
    ({"push": {**PUSH, "body": 1}}, "push[0].body", 1),
    ({"push": {**PUSH, "body": None}}, "push[0].body", None),
    ({"push": {**PUSH, "body": ["torso"]}}, "push[0].body", ["torso"]),
    ({"push": {**PUSH, "duration": 0.0}}, "push[0].duration", 0.0),
    ({"push": {**PUSH, "start": -1.0}}, "push[0].start", -1.0),
    ({"push": {**PUSH, "direction": [0, 0, 0]}}, "push[0].direction", [0, 0, 0]),
    ({"push": {**PUSH, "direction": [{"uniform": [0, 0]}, 0, {"choice": [0]}]}}, "push[0].direction", None),
    ({"push": {**PUSH, "direction": {"choice": [[1, 0, 0], [0, 0, 0]]}}}, "push[0].direction.choice[1]", [0, 0, 0]),
    ({"friction": 0.0}, "friction.coefficient", 0.0),
    ({"friction": {"coefficient": 0.8, "rolling": 0.1}}, "friction key", "rolling"),
]


@pytest.mark.parametrize(("given_", "field", "value"), WRONG, ids=range(len(WRONG)))
def test_refusals_name_the_field_the_value_and_what_is_allowed(given_, field, value):
    with pytest.raises(DisturbanceError) as caught:
        parse(given_)
    error = caught.value
    assert error.field == field
    if value is not None:
        assert error.value is value or error.value == value
        assert repr(value)[:100] in str(error)  # long ones are shortened
    assert field in str(error)
    assert error.allowed
    assert error.allowed in str(error)


def test_refusals_say_what_was_likely_meant():
    for wrong, words in [
        ({"payloads": 1.0}, "did you mean 'payload'"),
        ({"payload": {"masss": 1.0}}, "did you mean 'mass'"),
        ({"push": {**PUSH, "body": "chset"}}, "did you mean 'chest'"),
        ({"payload": {"mass": 7.0}}, "0.001 to 5 kg"),
        ({"payload": {"position": [0, 0, 0]}}, "no default"),
        ({"push": {**PUSH, "body": None}}, "allowed: chest, left_arm, right_arm, torso"),
    ]:
        with pytest.raises(DisturbanceError, match=words):
            parse(wrong)


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("kind", DISTURBANCES.values(), ids=list(DISTURBANCES))
def test_a_robot_refuses_the_kinds_that_it_cannot_honour(robot, kind):
    example = {
        p.name: words(p)[0] if p.size == 0 else [p.low] * p.size if p.size > 1 else p.low
        for p in complete(kind)
        if p in kind.parameters_for(robot)
    }
    given_ = {kind.name: example}
    if kind.honored_by(robot):
        assert Disturbances.parse(given_, SITES, JOINTS, robot).entries
        return
    with pytest.raises(DisturbanceError) as caught:
        Disturbances.parse(given_, SITES, JOINTS, robot)
    assert caught.value.field == "disturbances"
    assert caught.value.value == kind.name
    assert robot in caught.value.allowed
    named = caught.value.allowed.split(" (did you mean")[0].replace(",", "").split()
    assert set(named) >= {other.name for other in DISTURBANCES.values() if other.honored_by(robot)}
    assert set(named).isdisjoint(other.name for other in DISTURBANCES.values() if not other.honored_by(robot))


def test_each_robot_has_its_kinds_and_defaults():
    assert {"friction", "slope", "grf_pulse", "encoder_bits", "initial_pose"} <= {
        kind.name for kind in DISTURBANCES.values() if kind.honored_by("ojas") and not kind.honored_by("q450")
    }
    assert {"wind", "ground_effect", "initial_position", "cable_delay"} == {
        kind.name for kind in DISTURBANCES.values() if kind.honored_by("q450") and not kind.honored_by("ojas")
    }
    push = {"magnitude": 1, "start": 0}
    for robot, body, place in (("ojas", "torso", [0.0, 0.0, 0.16]), ("q450", "body", [0.01, 0.0, -0.1])):
        parsed = Disturbances.parse({"payload": 1.0, "push": push}, (body, "other"), JOINTS, robot)
        sampled = parsed.sample(np.random.default_rng(0))
        assert sampled["payload"]["position"] == place
        assert sampled["push"][0]["body"] == body
        assert Disturbances.parse(sampled, (body,), JOINTS, robot).sample(np.random.default_rng(1)) == sampled


KEYS = [
    *DISTURBANCES,
    *(p.name for kind in DISTURBANCES.values() for p in kind.parameters),
    "uniform",
    "normal",
    "choice",
]
KEYS += [word for kind in DISTURBANCES.values() for p in kind.parameters for word in words(p)]
atoms = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from([0, 1, 7, 0.5, 1e-300, 1e300, -0.0, 10**400, *KEYS])
    | st.text(max_size=3)
)
anything = st.recursive(
    atoms,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=300)
@given(given_=st.dictionaries(st.sampled_from(list(DISTURBANCES)), anything, max_size=3) | anything)
def test_whatever_is_given_is_read_or_refused(given_):
    try:
        sampled = draw(given_)
    except DisturbanceError as error:
        sampled = {}
        str(error)
    check_realised(sampled)


@settings(max_examples=300)
@given(
    name=st.sampled_from([(kind.name, p.name) for kind in DISTURBANCES.values() for p in kind.parameters]),
    value=anything,
)
def test_whatever_is_given_for_one_parameter_is_read_or_refused(name, value):
    kind, parameter = name
    base = {
        p.name: words(p)[0] if p.size == 0 else p.low
        for p in complete(DISTURBANCES[kind], parameter)
        if p.default is None
    }
    field = ""
    try:
        sampled = draw({kind: {**base, parameter: value}})
    except DisturbanceError as error:
        field = error.field
    else:
        check_realised(sampled)
    assert not field or parameter in field


def test_the_page_of_the_documentation_is_the_schema():
    """Mend with `python -m artde_gym.disturbances > docs/disturbances.md`."""
    stored = Path(__file__).parents[2] / "docs" / "disturbances.md"
    assert stored.read_text(encoding="utf-8") == page()
