"""Manipulators: the built-in Panda, and any arm from a URDF or MJCF file."""
