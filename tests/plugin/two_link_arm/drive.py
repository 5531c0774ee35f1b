"""How the arm is driven: one law on both joints, at these gains."""

import numpy as np

from controllers.drive import Drive, Preset
from controllers.laws.artde import ArtdeGains
from controllers.laws.tde import TdeGains
from controllers.loop import Loop
from two_link_arm.env import JOINTS, reference
from two_link_arm.model import Arm

_TDE = (0.06, 100.0, 20.0)  # m_bar, k_p, k_d
_ARTDE = ArtdeGains(*_TDE, alpha=4.0, gamma_0=1.0, gamma_1=1.0, beta_floor=0.01, beta_start=0.01, eps=0.01)


def loops():
    """Return both joints along the swing."""
    time = np.linspace(0.0, 2.0, 101)
    return [Loop("joints", JOINTS, "kg m^2", time, Arm().joint_inertia(reference(time)[0]))]


DRIVE = Drive(
    robot="two-link-arm",
    presets={
        ("tde", "hand"): Preset(TdeGains(*_TDE), "by hand"),
        ("artde", "hand"): Preset(_ARTDE, "by hand"),
    },
    ranges={"tde": {"m_bar": (0.02, 0.08), "k_p": (20.0, 400.0), "k_d": (5.0, 60.0)}},
    period=0.002,
    loops=loops,
)
