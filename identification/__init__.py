"""What the runs say: models, their fit, and the physical effect that a simulation is missing."""
