"""The thesis' claims about the Q450."""

from __future__ import annotations

from artde_gym.robots.q450.thesis import ATTITUDE, POSITION
from artde_gym.studies.reproduce.claims import ADDED, Claim, adapts, falls, improves, ordered, safer, settles

CLAIMS: tuple[Claim, ...] = (
    Claim(
        "Q1",
        "no controller crashes",
        "no controller crashes",
        falls("Q1", {"atde": False, "asmc": False, "artde": False}),
    ),
    *(
        Claim(
            "Q1",
            f"ARTDE's RMSE is below {rival.upper()}'s in y and z by more than 30 %",
            f"> 30 % printed; {true} follow from table 3.1",
            improves("Q1", rival, "rmse_m", ("y", "z"), 30.0),
        )
        for rival, true in (("atde", "33 and 69 %"), ("asmc", "23 and 69 %"))
    ),
    *(
        Claim(
            "Q1",
            f"ARTDE's peak error is below {rival.upper()}'s in x, y and z",
            f"{true} in table 3.1",
            improves("Q1", rival, "max_abs_error_m", POSITION),
        )
        for rival, true in (("atde", "0, 19 and 7 %"), ("asmc", "31, 12 and 0 %"))
    ),
    *(
        Claim(
            "Q1",
            f"ARTDE's RMS roll and pitch errors are below {rival.upper()}'s",
            f"{true} in table 3.1",
            improves("Q1", rival, "rmse_deg", ATTITUDE[:2]),
        )
        for rival, true in (("atde", "37 and 25 %"), ("asmc", "-4 and 5 %"))
    ),
    *(
        Claim(
            "Q1",
            f"ARTDE's peak attitude error is below {rival.upper()}'s on every axis",
            f"{true} in table 3.1",
            improves("Q1", rival, "max_abs_error_deg", ATTITUDE),
        )
        for rival, true in (("atde", "51, 25 and 4 %"), ("asmc", "22, 3 and 23 %"))
    ),
    *(
        Claim(
            "Q1",
            f"ARTDE sways less than {rival.upper()} after the payload's drop (peak error)",
            "the others sway, ARTDE does not",
            improves("Q1", rival, "peak_error_m", ("drop",)),
        )
        for rival in ("atde", "asmc")
    ),
    *(
        Claim(
            name,
            f"adaptation improves on {what} in wind (ARTDE against {rival})",
            ADDED,
            adapts(name, rival, "rmse_m"),
            ablation=rival == "tde+kd",
        )
        for name in ("Q1", "Q1-gale")
        for what, rival in (("plain TDE", "tde"), ("the equivalent extra stiffness", "tde+kd"))
    ),
    Claim(
        "Q1-calm",
        "ARTDE is better than ATDE, and ATDE than TDE, also without wind",
        ADDED,
        ordered("Q1-calm", ("artde", "atde", "tde"), "rmse_m"),
    ),
    *(
        claim
        for name in ("Q-sling", "Q-sling-gale")
        for claim in (
            Claim(
                name,
                "laws of the thesis lose more flights with a load on a cable than TDE with the swing term",
                ADDED,
                safer(name, "tde+swing", ("tde", "atde", "artde")),
            ),
            Claim(
                name,
                "a kicked load settles under the swing term, and not under the laws of the thesis",
                ADDED,
                settles(name, "recovery_time_s_push0_swing", {"tde+swing": True, "tde": False, "artde": False}),
            ),
            Claim(
                name,
                "tight tracking does not damp a swing: a kicked load never settles under tuned TDE",
                ADDED,
                settles(name, "recovery_time_s_push0_swing", {"tde-tight": False}),
            ),
            Claim(
                name,
                "the swing term needs no mass: its load error is below that of the control of the load, which knows it",
                ADDED,
                ordered(name, ("tde+swing", "geometric-load"), "rms_load_error_m"),
            ),
            Claim(
                name,
                "adaptation adds once the swing is damped (error of the load, ARTDE against TDE, both with the term)",
                ADDED,
                ordered(name, ("artde+swing", "tde+swing"), "rms_load_error_m"),
            ),
        )
    ),
    Claim(
        "Q-sling-late",
        "a cable vector 60 ms late breaks the swing term: TDE with it crashes",
        ADDED,
        falls("Q-sling-late", {"tde+swing": True}),
    ),
)
