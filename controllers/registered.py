"""The controllers that this package brings, found by the entry-point group `artde_gym.controllers`."""

from __future__ import annotations

from typing import Any

from artde_gym.registration import ControllerSpec


def _law(name: str, text: str, **kwargs: Any) -> ControllerSpec:
    return ControllerSpec(name, "controllers.robots:make_for_robot", kwargs, text, "controllers.robots:tuning_space")


CONTROLLERS = (
    _law("tde", "time-delay estimation", law="tde"),
    _law("atde", "TDE + one adaptive gain", law="atde"),
    _law("artde", "TDE + adaptive-robust term, as printed in the thesis", law="artde"),
    _law("artde-robust", "ARTDE with bounded gains", law="artde", preset="robust"),
    _law("tde-stiff", "biped: TDE at a larger m_bar, with a margin to its limit", law="tde", preset="stiff"),
    _law("pid", "PID; biped: equal to TDE, quadrotor: positional, in both loops", law="pid"),
    _law("tde+c", "TDE + robust term of constant gain (ablation)", law="tde+c"),
    _law("tde+kd", "TDE at the stiffer gains equivalent to it (ablation)", law="tde+kd"),
    _law("asmc", "quadrotor: adaptive sliding mode (this project's own law)", law="asmc"),
    _law("indi", "quadrotor: incremental nonlinear dynamic inversion", law="indi"),
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
        "biped: feedback linearisation with the nominal model (upper reference)",
        "controllers.model_based:tuning_space",
    ),
)
