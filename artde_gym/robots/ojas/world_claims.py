"""The claims of Ojas over plausible worlds: those of the thesis, and what constant stiffness does in their place."""

from __future__ import annotations

from artde_gym.studies.multiverse.claims import WorldClaim, ordered, pattern, smaller, survives

CLAIMS: tuple[WorldClaim, ...] = (
    ordered("tde", "atde", "artde"),
    pattern({"tde": True, "atde": True, "artde": False}),
    survives("artde", "tde"),
    survives("artde", "atde"),
    survives("atde", "tde"),
    survives("artde-robust", "artde"),
    survives("tde+kd", "artde"),
    survives("matched", "artde"),
    smaller("artde", "tde"),
    smaller("artde", "atde"),
    smaller("atde", "tde"),
    smaller("artde-robust", "artde"),
    smaller("tde+kd", "artde"),
    smaller("matched", "artde"),
)
