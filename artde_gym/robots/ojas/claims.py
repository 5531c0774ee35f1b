"""The thesis' claims about Ojas."""

from __future__ import annotations

from artde_gym.robots.ojas.thesis import JOINTS
from artde_gym.studies.reproduce.claims import Claim, adapts, falls, improves, repeats

_FALL = {"tde": True, "atde": True, "artde": False}
_WALK = {"tde": False, "atde": False, "artde": False}

CLAIMS: tuple[Claim, ...] = (
    Claim("S1", "no controller falls", "no controller falls", falls("S1", _WALK)),
    *(
        Claim(
            "S1",
            f"ARTDE's RMSE is below {rival.upper()}'s on every joint by at least {least} %",
            f">= {least} % printed; {true} % follows from table 2.1",
            improves("S1", rival, "rmse_deg", JOINTS, least),
        )
        for rival, least, true in (("tde", 29.1, 32.7), ("atde", 20.6, 20.1))
    ),
    *(
        Claim(
            "S1",
            f"ARTDE's maximum error is below {rival.upper()}'s on every joint",
            f">= {least} % in table 2.1",
            improves("S1", rival, "max_abs_error_deg", JOINTS),
        )
        for rival, least in (("tde", 38.1), ("atde", 21.1))
    ),
    Claim("S2", "TDE and ATDE fall with the payload, ARTDE does not", "26 s, 31 s, walks", falls("S2", _FALL)),
    Claim("S3", "ARTDE survives both pushes", "walks", falls("S3", {"artde": False})),
    Claim(
        "S3",
        "ARTDE's RMSE repeats that of S2 within 15 % on every joint",
        "<= 14 % (q2 of phase 3)",
        repeats("S3", "S2", "rmse_deg", JOINTS, 15.0),
    ),
    Claim("S1-L4", "at 4 ms: no controller falls", "1 ms in the thesis", falls("S1-L4", _WALK)),
    Claim("S2-L4", "at 4 ms: TDE and ATDE fall with the payload, ARTDE does not", "1 ms", falls("S2-L4", _FALL)),
    Claim("S3-L4", "at 4 ms: ARTDE survives both pushes", "1 ms in the thesis", falls("S3-L4", {"artde": False})),
    *(
        Claim(
            name,
            "adaptation improves on the equivalent extra stiffness (ARTDE against tde+kd)",
            "ours",
            adapts(name, "tde+kd", "rmse_deg"),
            ablation=True,
        )
        for name in ("S1", "S2", "S3", "S1-L4", "S2-L4", "S3-L4")
    ),
)
