"""The thesis' claims about Ojas, and this project's own questions."""

from __future__ import annotations

from artde_gym.robots.ojas.kit import FITTED
from artde_gym.robots.ojas.thesis import JOINTS
from artde_gym.studies.reproduce.claims import ADDED, Claim, adapts, beats, falls, improves, outlasts, repeats, stays

_FALL = {"tde": True, "atde": True, "artde": False}
_WALK = {"tde": False, "atde": False, "artde": False}
_SIZES = {
    "-GRF33": "with a ground force of 33 % of the weight: ",
    "-GRF45": f"with a ground force of 45 % of the weight ({FITTED}): ",
    "-GRF50": "with a ground force of 50 % of the weight: ",
}
_ALL = ("", "-L4", *_SIZES)


def _tracking(suffix: str, said: str) -> tuple[Claim, ...]:
    """List what the thesis claims of the errors in S1 and S3."""
    s1, s3 = f"S1{suffix}", f"S3{suffix}"
    return (
        *(
            Claim(
                s1,
                f"{said}ARTDE's RMSE is below {rival.upper()}'s on every joint by at least {least} %",
                f">= {least} % printed; {true} % follows from table 2.1",
                improves(s1, rival, "rmse_deg", JOINTS, least),
            )
            for rival, least, true in (("tde", 29.1, 32.7), ("atde", 20.6, 20.1))
        ),
        *(
            Claim(
                s1,
                f"{said}ARTDE's maximum error is below {rival.upper()}'s on every joint",
                f">= {least} % in table 2.1",
                improves(s1, rival, "max_abs_error_deg", JOINTS),
            )
            for rival, least in (("tde", 38.1), ("atde", 21.1))
        ),
        Claim(
            s3,
            f"{said}ARTDE's RMSE repeats that of S2 within 15 % on every joint",
            "<= 14 % (q2 of phase 3)",
            repeats(s3, f"S2{suffix}", "rmse_deg", JOINTS, 15.0),
        ),
        Claim(
            f"S2{suffix}",
            f"{said}the payload changes ARTDE's RMSE by less than 5 % on q2 to q6",
            "<= 4.9 % (q6) between tables 2.1 and 2.2",
            stays(f"S2{suffix}", s1, "rmse_deg", JOINTS[1:], 5.0),
        ),
    )


def _falls(suffix: str, said: str, period: str = "") -> tuple[Claim, ...]:
    """List what the thesis claims of falls."""
    s1, s2, s3 = (f"{name}{suffix}" for name in ("S1", "S2", "S3"))
    times = "1 ms" if period else "26 s, 31 s, walks"
    return (
        Claim(s1, f"{said}no controller falls", period or "no controller falls", falls(s1, _WALK)),
        Claim(s2, f"{said}TDE and ATDE fall with the payload, ARTDE does not", times, falls(s2, _FALL)),
        Claim(s3, f"{said}ARTDE survives both pushes", period or "walks", falls(s3, {"artde": False})),
    )


CLAIMS: tuple[Claim, ...] = (
    *_falls("", ""),
    *_tracking("", ""),
    *_falls("-L4", "at 4 ms: ", "1 ms in the thesis"),
    *(claim for suffix, said in _SIZES.items() for claim in (*_falls(suffix, said), *_tracking(suffix, said))),
    Claim(
        "S2",
        "ARTDE survives a larger ground force than ATDE, and ATDE than TDE",
        "26 s, 31 s, walks, at one size that it does not give",
        outlasts(("artde", "atde", "tde")),
        curve="grf_pulse.magnitude",
    ),
    *(
        Claim(
            f"{name}{suffix}",
            "adaptation improves on the equivalent extra stiffness (ARTDE against tde+kd)",
            ADDED,
            adapts(f"{name}{suffix}", "tde+kd", "rmse_deg"),
            ablation=True,
        )
        for suffix in _ALL
        for name in ("S1", "S2", "S3")
    ),
    *(
        Claim(
            f"{name}{suffix}",
            "ARTDE at the thesis' m_bar of 0.042 beats TDE at the preset stiff, 0.077",
            ADDED,
            adapts(f"{name}{suffix}", "tde-stiff", "rmse_deg"),
        )
        for suffix in _ALL
        for name in ("S1", "S2", "S3")
    ),
    *(
        Claim(
            f"{name}{suffix}",
            f"{law.upper()} that switches with the support phase beats {law.upper()} {said}",
            ADDED,
            beats(f"{name}{suffix}", f"{law}-switched", rival.format(law), "rmse_deg"),
            takes=(f"{law}-switched", rival.format(law)),
        )
        for suffix in _ALL
        for name in ("S1", "S2", "S3")
        for law in ("tde", "atde", "artde")
        for rival, said in (("{}", "at the thesis' m_bar of 0.042"), ("{}-stiff", "at the preset stiff, 0.077"))
    ),
)
