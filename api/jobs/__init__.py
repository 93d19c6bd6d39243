"""Jobs: work on captured runs, each in a process of its own; one file for each kind."""
