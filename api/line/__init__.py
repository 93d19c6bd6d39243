"""The line between the service and the worker of a rig: it needs no store, and a stop travels on it."""
