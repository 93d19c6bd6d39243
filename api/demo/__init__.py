"""The main job end to end on one machine: what ``damper-rig demo`` does."""
