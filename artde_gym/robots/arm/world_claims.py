"""The claims of the arm over plausible worlds: those of the thesis, and what constant stiffness does in their place."""

from __future__ import annotations

from artde_gym.studies.multiverse.claims import WorldClaim, ordered, smaller, survives

_RIVALS = ("tde", "atde", "pid", "computed-torque")

CLAIMS: tuple[WorldClaim, ...] = (
    ordered("tde", "atde", "artde"),
    *(survives("artde", rival) for rival in _RIVALS),
    survives("artde-robust", "artde"),
    survives("matched", "artde"),
    *(smaller("artde", rival) for rival in _RIVALS),
    smaller("artde-robust", "artde"),
    smaller("matched", "artde"),
    smaller("tde", "pid"),
)
