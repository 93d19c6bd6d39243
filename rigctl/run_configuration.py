"""The configuration that a rig is given for one test: rate, buffers, watchdog and limits."""

from __future__ import annotations

from typing import Final

from excitation.plan import Test
from rigctl.errors import LimitError
from rigctl.limits import Configuration
from rigctl.limits_together import limits_together
from rigctl.player_settings import PlayerSettings
from rigctl.transport import Capability, Identity

__all__ = ["run_configuration"]

PREFILL_S: Final = 1.5  # of set-points in the FIFO before the rig starts, at most half of MOST_BUFFERED_S
MOST_BUFFERED_S: Final = 2.5  # of set-points in the FIFO, at most three quarters of it


def run_configuration(test: Test, identity: Identity, settings: PlayerSettings) -> Configuration:
    """The configuration for a test; LimitError where the rig does not play its rate."""
    rate = test.excitation.sample_rate_hz
    _check_rate(test, identity, rate)
    whole, fifo = identity.takes_whole, identity.fifo_samples
    most = fifo * 3 // 4 if whole else min(round(MOST_BUFFERED_S * rate), fifo * 3 // 4)
    return Configuration(
        sample_rate_hz=rate,
        prefill_samples=most // 2 if whole else min(round(PREFILL_S * rate), most // 2),
        low_water_samples=most // 3,
        high_water_samples=most,
        heartbeat_s=settings.watchdog_s,
        limits=limits_together(identity.limits, settings.limits, settings.envelopes, test),
        further_axes=Capability.FURTHER_AXES in identity.capabilities,
    )


def _check_rate(test: Test, identity: Identity, rate_hz: float) -> None:
    if not identity.sample_rate_min_hz <= rate_hz <= identity.sample_rate_max_hz:
        raise LimitError(
            f"test {test.name!r}: sample_rate is {rate_hz:g} Hz, "
            f"the rig plays {identity.sample_rate_min_hz:g} … {identity.sample_rate_max_hz:g} Hz"
        )
    step = identity.rate_step_hz
    if step and abs(rate_hz - (played := round(rate_hz / step) * step)) > 1e-9 * rate_hz:
        raise LimitError(
            f"test {test.name!r}: sample_rate is {rate_hz:.9g} Hz, the rig plays whole multiples of {step:g} Hz: "
            f"design the test at {played:.9g} Hz"
        )
