"""Drives of the project's own robots, one module each."""
