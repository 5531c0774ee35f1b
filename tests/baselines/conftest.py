"""Training needs PyTorch: without it, its module is not collected, and the rest of these tests is."""

import importlib.util

collect_ignore = [] if importlib.util.find_spec("torch") else ["test_training.py"]
