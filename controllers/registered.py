"""The controllers that this package brings, found by the entry-point group `artde_gym.controllers`."""

from __future__ import annotations

from typing import Any

from artde_gym.registration import ControllerSpec
from controllers.law_table import GAINS, LAWS


def _law(name: str, text: str, **kwargs: Any) -> ControllerSpec:
    return ControllerSpec(name, "controllers.robots:make_for_robot", kwargs, text, "controllers.robots:tuning_space")


CONTROLLERS = (
    *(_law(name, LAWS[name].text, law=name) for name in GAINS),
    _law("artde-robust", "ARTDE with bounded gains", law="artde", preset="robust"),
    _law("tde-stiff", "biped: TDE at a larger m_bar, with a margin to its limit", law="tde", preset="stiff"),
    _law("atde-stiff", "biped: ATDE at a larger m_bar, with a margin to its limit", law="atde", preset="stiff"),
    _law("artde-stiff", "biped: ARTDE at a larger m_bar, with a margin to its limit", law="artde", preset="stiff"),
    _law("tde-tight", "quadrotor: TDE tuned on Q1, whose tracking is the tightest", law="tde", preset="tuned"),
    _law("geometric", "quadrotor: geometric control on SE(3), with an integral", law="geometric"),
    *(
        _law(
            f"{law}+swing",
            f"quadrotor with a cable: {law.upper()} + a term that damps the load's swing",
            law=f"{law}+swing",
        )
        for law in ("tde", "atde", "artde")
    ),
    _law(
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
