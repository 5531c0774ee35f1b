"""Speed of the arm."""

from __future__ import annotations

from artde_gym.arrays import Array
from artde_gym.benchmark.environments import ENGINES, arm
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import TURN, ClosedLoop, Replay, in_turns
from artde_gym.sim.engine_loops import joint_loop

STEPS = 6000


class BareArm(Replay):
    """The same torques in the engine alone, without friction."""

    def __init__(self, loop: ClosedLoop, engine: str) -> None:
        super().__init__(loop, arm(engine=engine))
        self._advance = joint_loop(self.env._engine)

    def step(self, action: Array) -> None:
        self._advance(action)


def tracking(quick: bool) -> Section:
    """Measure the same motion in closed loop, in the environment alone and in the bare engine."""
    variants = {}
    for engine in ENGINES:
        tde, artde = (ClosedLoop(name, arm(engine=engine)) for name in ("tde", "artde"))
        variants |= {
            (engine, "tde"): tde.turn,
            (engine, "artde"): artde.turn,
            (engine, "environment"): Replay(artde, arm(engine=engine)).turn,
            (engine, "bare"): BareArm(artde, engine).turn,
        }
    times = in_turns(variants, STEPS // TURN // (10 if quick else 1))
    figures = []
    for engine, written in ENGINES.items():
        bare = times[engine, "bare"]
        figures.append(Figure(f"{written}, bare: write torques, step, read joints", 1e6 * bare / TURN, "us per step"))
        for variant, text in (("environment", "env.step"), ("tde", "closed loop TDE"), ("artde", "closed loop ARTDE")):
            took = times[engine, variant]
            figures.append(Figure(f"{written}, {text}", 1e6 * took / TURN, "us per step"))
            figures.append(Figure(f"{written}, {text}: rate against bare", bare / took))
    text = (
        f"{STEPS} steps of pick and place with the built-in arm at a control period of 1 ms (a physics step each), on "
        "one core. The environment alone and the bare engine repeat the torques of ARTDE's closed loop. Beyond the "
        "engine's step the environment computes friction of seven joints, the tool's position, reward and `info`."
    )
    skipped = "" if len(ENGINES) > 1 else "the PyBullet part: PyBullet is not installed; see `artde-gym doctor`"
    return Section("The arm", text, tuple(figures), skipped)
