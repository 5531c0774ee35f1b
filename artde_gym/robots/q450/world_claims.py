"""The claims of the Q450 over plausible worlds: those of the thesis, and what rivals without adaptation do."""

from __future__ import annotations

from artde_gym.studies.multiverse.claims import WorldClaim, ordered, smaller, survives

CLAIMS: tuple[WorldClaim, ...] = (
    ordered("tde", "atde", "artde"),
    *(survives("artde", rival) for rival in ("tde", "atde", "asmc", "pid", "geometric", "indi")),
    survives("matched", "artde"),
    *(smaller("artde", rival) for rival in ("tde", "atde", "asmc", "pid", "geometric", "indi")),
    smaller("matched", "artde"),
    *(smaller("artde", rival, "peak_error_m_drop") for rival in ("atde", "asmc", "matched")),
)
