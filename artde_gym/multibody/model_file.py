"""Model files of users as text, and the tree of links that readers of any format make of them.

A file may come from anywhere: it is checked before any parser sees it, and a format's reader rejects what it cannot
honor by name instead of dropping it.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from artde_gym.errors import RobotError

MAX_BYTES = 4_000_000
MAX_LINKS = 200
MAX_DEPTH = 250  # of nested elements
NAME_LENGTH = 100

_REFUSED = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)


class FileJoint(NamedTuple):
    """A joint that moves one link.

    Attributes:
        axis: unit vector in the link's frame.
        prismatic: True if it slides.
        limits: lowest and highest position (rad or m); infinite without limits.
        effort, speed: limits (Nm or N; rad/s or m/s); infinite where the file has none.
        damping, coulomb, armature: viscous and dry friction, and reflected inertia.
        follows: reason why it does not move by itself, such as a mimic joint's; "" if it does.
    """

    name: str
    axis: np.ndarray
    prismatic: bool
    limits: tuple[float, float]
    effort: float = math.inf
    speed: float = math.inf
    damping: float = 0.0
    coulomb: float = 0.0
    armature: float = 0.0
    follows: str = ""


class FileLink(NamedTuple):
    """A link, its place in its parent's frame at the zero position, and the joint that carries it.

    `com` (3,) is in the link's frame, and so is `inertia` (3, 3), which is about the center of mass.
    """

    name: str
    parent: str | None
    origin: np.ndarray
    rotation: np.ndarray
    mass: float
    com: np.ndarray
    inertia: np.ndarray
    joint: FileJoint | None = None


class ModelTree(NamedTuple):
    """The links of a file, parents before children; the first one is fixed to the world."""

    file: str
    links: tuple[FileLink, ...]


def model_text(path: Path) -> str:
    """Read a model file as text.

    Raises:
        RobotError: for a file that cannot be read, is too large or no UTF-8, or has a document type.
    """
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise RobotError("robot", str(path), "the name of a built-in arm, or a URDF or MJCF file")
        if size > MAX_BYTES:
            raise RobotError(f"size of {path.name}", size, f"at most {MAX_BYTES} bytes")
        text = path.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RobotError("robot", str(path), f"a URDF or MJCF file in UTF-8 ({error})") from error
    if "\0" in text:  # of an encoding that the parser would detect, but the search for document types would not
        raise RobotError("robot", str(path), "a URDF or MJCF file in UTF-8 (it contains zero bytes)")
    if found := _REFUSED.search(text):
        raise RobotError(f"document type of {path.name}", found.group(), "none: entities are not expanded")
    return text


def parsed(text: str, file: str) -> ET.Element:
    """Parse XML without a document type.

    Raises:
        RobotError: for text that is not well-formed, or nested too deeply.
    """
    reader = ET.XMLPullParser(("start", "end"))
    root: ET.Element | None = None
    depth = 0
    try:
        for start in range(0, len(text), 4096):
            reader.feed(text[start : start + 4096])
            for event, element in cast(Iterator[tuple[str, ET.Element]], reader.read_events()):
                root = element if root is None else root
                depth += 1 if event == "start" else -1
                _check_element(element.tag, depth, file)
        reader.close()
    except (ET.ParseError, ValueError) as error:
        if isinstance(error, RobotError):
            raise
        raise RobotError("XML", file, f"well-formed XML ({error})") from error
    if root is None:
        raise RobotError("XML", file, "a <robot> or a <mujoco>")
    return root


def _check_element(tag: str, depth: int, file: str) -> None:
    if depth > MAX_DEPTH:
        raise RobotError(f"depth of elements in {file}", depth, f"at most {MAX_DEPTH}")
    if "xacro" in tag:
        raise RobotError(f"element of {file}", tag, f"URDF; expand it first: xacro {file} > robot.urdf")


def check_name(kind: str, name: str | None, file: str) -> str:
    """Return the name of a link or joint.

    Raises:
        RobotError: for a missing, too long or unprintable name.
    """
    if not (name and len(name) <= NAME_LENGTH and name.isprintable()):
        raise RobotError(f"name of a {kind} in {file}", name, f"1 to {NAME_LENGTH} printable characters")
    return name


def check_links(count: int, file: str) -> None:
    """Check the number of links.

    Raises:
        RobotError: for none, or more than `MAX_LINKS`.
    """
    if not 1 <= count <= MAX_LINKS:
        raise RobotError(f"links of {file}", count, f"1 to {MAX_LINKS}")
