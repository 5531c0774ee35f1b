"""Learned baselines: a residual on a classical controller, its training and its saved policies."""
