"""What a report says of the run that a model of the others does not describe."""

from __future__ import annotations

import pytest

from identification.discrepancy.odd import words_for
from identification.physical.model import Model, element
from identification.record import compact, record_from_run
from rigctl.runfile import with_channel
from tests.identification.ordinary import Floats, campaign

SPRING = Model(name="a spring", elements=(element("linear_stiffness", {"k": 5e4}),))
SIZES = (0.01, 0.012, 0.014)


def force(x: Floats, v: Floats) -> Floats:
    return 5e4 * x


@pytest.mark.parametrize("channel", ["force", "displacement"])
def test_of_a_run_that_fits_upside_down_the_polarity_is_told(channel: str) -> None:
    runs = list(campaign("mount", force, SIZES))
    runs[1] = with_channel(runs[1], channel, -runs[1].channels[channel], runs[1].units[channel])
    records = [compact(record_from_run(r)) for r in runs]
    said = words_for(records[1], SPRING, [records[0], records[2]])
    assert said.startswith(records[1].name)
    assert said.endswith("with the force upside down: the polarity of its force or motion is reversed")


def test_of_a_run_that_was_not_tared_it_is_asked_how_it_was_made() -> None:
    runs = list(campaign("mount", force, SIZES))
    runs[1] = with_channel(runs[1], "force", runs[1].channels["force"] + 150.0, "N")
    records = [compact(record_from_run(r)) for r in runs]
    said = words_for(records[1], SPRING, [records[0], records[2]])
    assert "a mean of 150 N" in said
    assert "polarity" not in said
