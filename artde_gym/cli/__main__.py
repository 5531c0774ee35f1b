"""Entry point of `python -m artde_gym.cli`."""

from artde_gym.cli import main

main()
