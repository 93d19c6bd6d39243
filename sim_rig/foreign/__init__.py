"""Simulated controllers of other makes, each written from its own map: they know nothing of this program's protocol."""
