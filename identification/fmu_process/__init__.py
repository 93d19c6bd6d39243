"""The process of an FMU and what runs in it; it imports no model, so that it starts in a quarter of the time."""
