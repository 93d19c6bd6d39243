"""A laboratory whose parts are killed, and a process that watches what the rig itself says meanwhile."""
