"""Generator of the page of the grammar: `python -m artde_gym.disturbances > docs/disturbances.md`."""

from artde_gym.disturbances.kinds import page

if __name__ == "__main__":
    print(page(), end="")
