"""The ground, the sky and a robot's shadow, painted behind what an engine drew: both engines' pictures look the same.

The ground is the plane z = 0 with a line every half meter; it fades into a white sky with the distance. Each pixel
takes the mean of what it covers, so that far lines neither flicker nor make patterns.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter

from artde_gym.arrays import Array
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.sim.camera import Camera
from artde_gym.sim.engine import PAYLOAD_LOOK, State
from artde_gym.sim.rotation import matrix

SUN: Vector = (1.0, 1.5, 3.0)  # towards it
SKY = (255, 255, 255)
FLOOR = (231, 236, 242)
LINE = (172, 186, 206)
SHADE = (0.80, 0.83, 0.90)  # what is left of the light in a shadow
SPACING = 0.5  # m, between lines
THICKNESS = 0.012  # m, of a line
FADING = 9.0  # m, after which two thirds of the ground have faded
SOFTNESS = 1.0  # pixels, of a shadow's edge

_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_FACES = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
_ROUND = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)


class Shadow:
    """Where a robot of boxes and a payload keep the sun from the ground."""

    def __init__(self, spec: RobotSpec) -> None:
        self._tree = tree = RigidBodyTree(spec)
        self._joints = [tree.joints.index(name) for name in spec.actuated]
        links = spec.merged().links
        boxes = [(number, box) for number, link in enumerate(links) for box in link.visuals]
        self._link = [number for number, _ in boxes]
        self._corners = np.array([np.add(box.center, _CORNERS * box.size) for _, box in boxes]).reshape(-1, 8, 3)

    def polygons(self, state: State, ball: Vector | None) -> list[Array]:
        """Corners (n, 3) (m) on the ground of polygons that overlap; the payload is at `ball` (m), if anywhere."""
        q = np.zeros(self._tree.n)  # joints that nobody actuates are held at zero
        q[self._joints] = state.q
        frames = self._tree.frames(q, np.array(matrix(state.quat_xyzw)).reshape(3, 3))
        turned = self._corners @ np.swapaxes(frames.rot[self._link], -1, -2)
        fallen = _cast(turned + frames.origin[self._link][:, None] + state.position)
        found = list(fallen[:, _FACES].reshape(-1, 4, 3))
        if ball is not None and ball[2] > 0:
            across, over = _beside(SUN)
            edge = PAYLOAD_LOOK * (np.cos(_ROUND)[:, None] * across + np.sin(_ROUND)[:, None] * over)
            found.append(_cast(np.asarray(ball) + edge))
        return found


def paint(picture: NDArray[np.uint8], bare: NDArray[np.bool_], camera: Camera, shadow: Sequence[Array]) -> None:
    """Paint ground and sky over the pixels that are `bare` (height, width): those on which an engine drew nothing."""
    x, y, z = camera.target
    view = _view(camera._replace(target=(0.0, 0.0, z)))
    picture[: view.top][bare[: view.top]] = SKY
    free = bare[view.top :]
    if not free.any():
        return
    along_y = _lines(view.x + np.float32(x % SPACING), view.wide)
    along_x = _lines(view.y + np.float32(y % SPACING), view.high)
    line = np.maximum(along_x, along_y)
    sun = _sunlight(camera, shadow)[view.top :]
    fog = view.fog
    for i in range(3):
        color = FLOOR[i] + (LINE[i] - FLOOR[i]) * line
        color *= 1.0 - (1.0 - SHADE[i]) * sun
        color += (SKY[i] - color) * fog
        picture[view.top :, :, i][free] = (color[free] + 0.5).astype(np.uint8)


class _View(NamedTuple):
    """What a camera over the world's origin sees of the ground: where each pixel of the rows from `top` on lies.

    `x`, `y` (m), `wide`, `high` how much of x and y a pixel covers (m), `fog` how far it has faded, 0 to 1.
    """

    top: int
    x: Array
    y: Array
    wide: Array
    high: Array
    fog: Array


@functools.lru_cache(maxsize=4)
def _view(camera: Camera) -> _View:
    right, up, away = camera.axes
    rows, columns = np.mgrid[: camera.height, : camera.width] + 0.5
    across = (columns - camera.width / 2) / camera.focal_length
    above = (camera.height / 2 - rows) / camera.focal_length
    rays = away + across[..., None] * right + above[..., None] * up
    eye = camera.eye
    downward = rays[:, 0, 2] < -1e-3  # the camera does not lean: a row looks down or it does not
    top = int(np.argmax(downward)) if downward.any() else camera.height
    rays = rays[top:]
    reach = -eye[2] / rays[..., 2]
    x, y = eye[0] + reach * rays[..., 0], eye[1] + reach * rays[..., 1]
    fog = 1.0 - np.exp(-((np.hypot(x, y) / FADING) ** 2))
    wide, high = (_extent(values) for values in (x, y))
    return _View(top, *(values.astype(np.float32) for values in (x, y, wide, high, fog)))


def _extent(values: Array) -> Array:
    """How much a pixel covers of what changes over rows and columns."""
    if min(values.shape) < 2:
        return np.ones_like(values)
    down, across = np.gradient(values)
    return np.abs(down) + np.abs(across)


def _lines(place: Array, extent: Array) -> Array:
    """Share of each pixel that lies on a line."""
    distance = np.abs(place - SPACING * np.round(place / SPACING))
    covered = np.minimum((THICKNESS + extent) / 2 - distance, np.minimum(THICKNESS, extent))
    share = np.clip(covered, 0.0, None) / extent
    return np.where(extent > SPACING, THICKNESS / SPACING, share)


def _sunlight(camera: Camera, shadow: Sequence[Array]) -> Array:
    """How deep each pixel (height, width) of the ground is in the shadow, 0 to 1."""
    mask = Image.new("L", (camera.width, camera.height))
    draw = ImageDraw.Draw(mask)
    if shadow:
        ends = np.cumsum([len(polygon) for polygon in shadow])[:-1]
        for corners in np.split(camera.pixels(np.concatenate(shadow)), ends):
            if np.isfinite(corners).all():
                draw.polygon([*map(tuple, corners.tolist())], fill=255)
    return np.asarray(mask.filter(ImageFilter.GaussianBlur(SOFTNESS)), dtype=np.float32) / 255


def _cast(points: Array) -> Array:
    """Where the shadows of points (..., 3) fall."""
    height = np.maximum(points[..., 2:], 0.0)
    return (points - height * np.divide(SUN, SUN[2])) * (1.0, 1.0, 0.0)


def _beside(direction: Vector) -> tuple[Array, Array]:
    """Two unit vectors across a direction, and each other."""
    towards = np.asarray(direction) / np.linalg.norm(direction)
    across = np.cross(towards, (0.0, 0.0, 1.0))
    across /= np.linalg.norm(across)
    return across, np.cross(across, towards)
