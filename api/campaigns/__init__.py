"""Campaigns: tests that are played on a rig in order, and how each ended."""
