"""The Q450, a quadrotor."""
