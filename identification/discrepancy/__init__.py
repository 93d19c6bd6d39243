"""From a gap between simulation and measurement to the name of what is missing."""
