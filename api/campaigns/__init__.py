"""Campaigns: what is asked of a rig, played in order, each end written down as it was."""
