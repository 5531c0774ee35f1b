"""How fast the biped walks."""

from __future__ import annotations

from artde_gym.arrays import Array
from artde_gym.benchmark.environments import ENGINES, biped
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import TURN, ClosedLoop, Replay, in_turns
from artde_gym.sim.engine_loops import joint_loop

STEPS = 5900  # two seconds of standing, two steps, standing again
LEAST = {("bullet", "environment"): 0.85, ("bullet", "artde"): 0.75}
"""Rates against the bare engine that the project wants, by engine and variant."""


class BareWalk(Replay):
    """The same torques, and so the same contacts, in the engine alone."""

    def __init__(self, loop: ClosedLoop, engine: str) -> None:
        super().__init__(loop, biped(engine=engine))
        self._advance = joint_loop(self.env._engine)

    def step(self, action: Array) -> None:
        self._advance(action)


def walking(quick: bool) -> Section:
    """Rates of the same walk in closed loop, in the environment alone and in the bare engine."""
    variants = {}
    for engine in ENGINES:
        tde, artde = (ClosedLoop(name, biped(engine=engine)) for name in ("tde", "artde"))
        variants |= {
            (engine, "tde"): tde.turn,
            (engine, "artde"): artde.turn,
            (engine, "environment"): Replay(artde, biped(engine=engine)).turn,
            (engine, "bare"): BareWalk(artde, engine).turn,
        }
    times = in_turns(variants, STEPS // TURN // (10 if quick else 1))
    figures = []
    for engine, written in ENGINES.items():
        bare = times[engine, "bare"]
        figures.append(Figure(f"{written}, bare: write torques, step, read joints", 1e6 * bare / TURN, "us a step"))
        for variant, text in (("environment", "env.step"), ("tde", "closed loop TDE"), ("artde", "closed loop ARTDE")):
            ratio, least = bare / times[engine, variant], LEAST.get((engine, variant))
            figures.append(Figure(f"{written}, {text}: rate against bare", ratio, least=least))
    if len(ENGINES) > 1:
        ratio = times["bullet", "artde"] / times["mujoco", "artde"]
        figures.append(Figure("MuJoCo against PyBullet, closed loop ARTDE: rate", ratio, least=3.0))
    text = (
        f"A walk of {STEPS} steps at a control period of 1 ms (a physics step each) with a payload and geared rotors, "
        "on one core. The environment alone and the bare engine repeat the torques of ARTDE's closed loop."
    )
    skipped = "" if len(ENGINES) > 1 else "its part in PyBullet, which is not installed: see `artde-gym doctor`"
    return Section("The biped", text, tuple(figures), skipped)
