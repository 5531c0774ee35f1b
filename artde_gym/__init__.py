"""Gymnasium environments and evaluation for time-delay control: TDE, ATDE, ARTDE and baselines."""

from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from artde_gym.deprecation import find_old_modules
from artde_gym.registration import register_all, register_controller

if TYPE_CHECKING:
    from artde_gym.evaluation.replay import replay

__version__ = version("artde-gym")
__all__ = ["__version__", "register_controller", "replay"]

find_old_modules()
register_all()


def __getattr__(name: str) -> Any:
    if name == "replay":  # with pandas behind it, imported only when asked for
        from artde_gym.evaluation.replay import replay

        return replay
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
