"""The simulated rig: a process of its own, whose true parameters show only in what its sensors measure."""
