"""`python -m artde_gym.disturbances > docs/disturbances.md` writes the page of the grammar from its own tables."""

from artde_gym.disturbances.kinds import page

if __name__ == "__main__":
    print(page(), end="")
