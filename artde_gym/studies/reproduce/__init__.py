"""The thesis' scenarios, run and judged claim by claim."""

from artde_gym.studies.reproduce.reproduction import Reproduction, reproduce

__all__ = ["Reproduction", "reproduce"]
