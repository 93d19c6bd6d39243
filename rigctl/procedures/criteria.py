"""The numbers that decide in the procedures: each with its unit, its reason, and what half and double of it do."""

from __future__ import annotations

from typing import Final

TARE_SHARE: Final = 0.04
"""Largest tare, as a share of the rig's force limit. On 25 kN: 1000 N, the weight of a fixture of 100 kg. A cell that
reads more without load is overloaded, or something is still attached. Half refuses heavy fixtures; double accepts a
cell that has yielded."""

TARE_NOISE_SHARE: Final = 0.01
"""Largest standard uncertainty of a tare, as a share of the largest tare. On 25 kN: 10 N. With more, the force is not
at rest. Half refuses a noisy but sound cell; double makes the tare a visible error of a small damper's friction."""

TARE_AGE_S: Final = 12 * 3600.0
"""Age from which on a stored tare is refused: a working day. Load cells drift with the temperature of the room by some
0.1 % of their capacity in a day."""

STILL_M: Final = 50e-6
"""Largest range of the displacement during a tare or another reading at rest. Fifty times the noise of a displacement
sensor of 1 µm, and on a spring of 1e5 N/m a force of 5 N. Half refuses a rig whose pump shakes it; double hides a
piston that creeps."""

SETTLED_S: Final = 0.3
"""Pause between the end of a movement and a reading: the oil column and a rubber bush come to rest."""

SLOW_M_S: Final = 0.01
"""Speed of every movement while a person may be near: 10 mm/s, the reduced speed of presses under hold-to-run control
(EN 693, EN ISO 16092-1). It is a limit of the rig as well, so that a fault of this program cannot exceed it."""

STEP_M: Final = 0.5e-3
"""Length of one step of a slow movement, after each of which the force is read. At 10 mm/s: 50 ms. On a spring of 1e6
N/m a step changes the force by 500 N. Half doubles the time; double lets the force grow further between readings."""

MOUNTING_FORCE_SHARE: Final = 0.05
"""Force at which a movement during mounting stops, as a share of the rig's force limit; the rig itself stops at twice
that force. On 25 kN: 1250 N. Below it a gas spring can be compressed by hand-guided mounting; half may not suffice
for that, double can bend a clevis that is not aligned."""

ZERO_SHARE: Final = 0.0008
"""Force below which a specimen counts as mounted without load, as a share of the force limit. On 25 kN: 20 N."""

ZERO_STEPS: Final = 40
"""Largest number of readings of a force-controlled zero; with more, force and position are not related."""

CRAWL_MARGIN: Final = 0.15
"""Share of each stroke of a crawl that is not used after a turning point: presliding and the controller settle."""

DISTINCT_STIFFNESS: Final = 5.0
"""A stiffness, in standard uncertainties, from which on something counts as attached during a weighing. With 3, one of
400 weighings without a specimen would be refused; with 10, a soft spring would be taken for nothing."""

MASS_MISFIT: Final = 0.05
"""Largest share of the force, at the excited lines, that may follow neither a mass nor a spring nor a viscous damper.
An error of that size in the force changes a mass by at most its own share."""

SKEW_SAMPLES: Final = 0.1
"""Standard uncertainty of the time between force and displacement, in samples. A delay τ between them makes a viscous
damper of c look like a mass of c τ, at every frequency. Data acquisitions with one clock and one kind of filter are
better than a tenth of a sample; with half of it the mass of a rig with a specimen in it is stated too sure."""
