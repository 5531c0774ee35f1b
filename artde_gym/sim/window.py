"""The window of live play: Bullet's if PyBullet is installed, else MuJoCo's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from artde_gym.sim.factory import missing_bullet

if TYPE_CHECKING:
    from artde_gym.sim.bullet_window import BulletWindow
    from artde_gym.sim.mujoco_window import MujocoWindow


def open_window() -> BulletWindow | MujocoWindow:
    """Open a window; call before making an engine, since Bullet's window stays black beside an older client.

    Raises:
        OptionError: without a display with OpenGL.
    """
    if missing_bullet():
        from artde_gym.sim.mujoco_window import MujocoWindow

        return MujocoWindow()
    from artde_gym.sim.bullet_window import BulletWindow

    return BulletWindow()
