"""Play it and record it: streams test plans to a rig and captures run files."""
