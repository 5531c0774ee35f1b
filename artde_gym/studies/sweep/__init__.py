"""A grid or a random sample of cases, on all cores or on a cluster, into one Parquet dataset."""

from artde_gym.studies.sweep.execution import Sweep, sweep
from artde_gym.studies.sweep.store import read_sweep

__all__ = ["Sweep", "read_sweep", "sweep"]
