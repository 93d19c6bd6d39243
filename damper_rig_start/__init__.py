"""The command `damper-rig` before it imports anything: whether this installation is whole."""
