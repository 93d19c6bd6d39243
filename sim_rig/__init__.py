"""A rig made of numbers: a process of its own that knows the truth and tells it only through its sensors."""
