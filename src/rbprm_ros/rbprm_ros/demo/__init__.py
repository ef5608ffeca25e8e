"""A stand-in for perception, which publishes the surfaces of a scenario."""
