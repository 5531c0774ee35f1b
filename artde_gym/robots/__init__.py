"""Robots as data, and the rigid-body algebra over them."""
