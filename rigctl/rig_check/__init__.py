"""A rig walked through before its first test: without motion, then, where somebody agrees, with one millimetre."""

from rigctl.rig_check.at_rest import check_at_rest
from rigctl.rig_check.in_motion import check_in_motion
from rigctl.rig_check.protocol import Finding, Protocol, Verdict, left_out

__all__ = ["Finding", "Protocol", "Verdict", "check_at_rest", "check_in_motion", "left_out"]
