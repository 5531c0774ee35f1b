"""The arm as replays show it: two rods that hang from a block."""

from artde_gym.motion.scene import Body, Outlook, Point, Scene
from artde_gym.multibody.spec import Box
from two_link_arm.model import LENGTH

HEIGHT = 1.0  # m, of the hinge
ROD = (Box((0.04, 0.04, LENGTH), (0.0, 0.0, -LENGTH / 2), (0.2, 0.4, 0.7, 1.0)),)
BACK = (0.0, -1.0, 0.0)  # about which an angle swings a rod ahead


def scene(kwargs, env_id):
    """Return what is drawn, whatever the arguments of the environment."""
    block = Body("block", (Box((0.12, 0.12, 0.06), (0.0, 0.0, 0.03)),))
    upper = Body("upper arm", ROD, parent=0, axis=BACK, joint=0)
    forearm = Body("forearm", ROD, parent=1, origin=(0.0, 0.0, -LENGTH), axis=BACK, joint=1)
    sites = {"tip": Point(2, (0.0, 0.0, -LENGTH))}
    outlook = Outlook(distance=2.6, yaw_deg=20.0, height=0.7, follows=False)
    return Scene((block, upper, forearm), sites, outlook=outlook, tint=ROD[0].color, payload_radius=0.06)
