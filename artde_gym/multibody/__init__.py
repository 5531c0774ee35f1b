"""Robots as data, the rigid-body algebra over them, and the model files that physics engines read."""
