"""Gymnasium environments and evaluation for time-delay control: TDE, ATDE, ARTDE and baselines."""

from importlib.metadata import version

from artde_gym.deprecation import find_old_modules
from artde_gym.registration import register_all, register_controller

__version__ = version("artde-gym")
__all__ = ["__version__", "register_controller"]

find_old_modules()
register_all()
