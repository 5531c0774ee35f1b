"""Robots as data, their rigid-body dynamics, and model files for physics engines."""
