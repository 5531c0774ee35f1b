"""The controllers that this package brings, found by the entry-point group `artde_gym.controllers`."""

from __future__ import annotations

from artde_gym.registration import ControllerSpec
from controllers.law_table import LAWS
from controllers.registration import law_controller

CONTROLLERS = (
    *(law_controller(name, spec.text, law=name) for name, spec in LAWS.items() if spec.gains is not None),
    law_controller("artde-robust", "ARTDE with bounded gains", law="artde", preset="robust"),
    law_controller("tde-stiff", "biped: TDE at a larger m_bar, with a margin to its limit", law="tde", preset="stiff"),
    law_controller(
        "atde-stiff", "biped: ATDE at a larger m_bar, with a margin to its limit", law="atde", preset="stiff"
    ),
    law_controller(
        "artde-stiff", "biped: ARTDE at a larger m_bar, with a margin to its limit", law="artde", preset="stiff"
    ),
    law_controller(
        "tde-tight", "quadrotor: TDE tuned on Q1, whose tracking is the tightest", law="tde", preset="tuned"
    ),
    law_controller("geometric", "quadrotor: geometric control on SE(3), with an integral", law="geometric"),
    *(
        law_controller(
            f"{law}+swing",
            f"quadrotor with a cable: {law.upper()} + a term that damps the load's swing",
            law=f"{law}+swing",
        )
        for law in ("tde", "atde", "artde")
    ),
    law_controller(
        "geometric-load",
        "quadrotor with a cable: geometric control of the load, whose mass it knows",
        law="geometric-load",
    ),
    ControllerSpec(
        "computed-torque",
        "controllers.model_based:make_computed_torque",
        {},
        "biped, arm: feedback linearization with the nominal model (upper reference)",
        "controllers.model_based:tuning_space",
    ),
)
