"""The command line: one file for each command; heavy imports stand inside the command that needs them."""
