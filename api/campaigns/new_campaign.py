"""A campaign as it is requested: checked whole before anything is stored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, ClassVar

from api.campaigns.texts import check_text
from api.campaigns.typed_tests import EnvelopeConfig, TestConfig
from api.errors import InputError
from api.findings import Findings
from api.store.samples import plays_samples
from excitation import TestPlan, plan_from_config
from excitation.configuration import to_spec
from excitation.envelope import predict_plan
from excitation.plan import MakeExcitation
from excitation.rig import Envelope
from excitation.synthesis import excitation_from_config, reads_a_file
from rigctl.address import check_address
from rigctl.calibration import calibrations_from, check_valid
from rigctl.canonical import canonical_address
from rigctl.interlocks import interlock

__all__ = ["NewCampaign", "check_reads_no_file", "note_excesses", "plan_of"]

TEXTS = ("operator", "specimen_serial", "fixture", "oil")
_MOST_TESTS = 500
_MOST_INTERLOCKS = 50
_MOST_ENVELOPES = 10
_MOST_RIG_TIME_S = 7 * 86400.0


@dataclass(frozen=True, kw_only=True)
class NewCampaign:
    """A body of POST /v1/campaigns: tests in order, on one rig, with one specimen.

    ``rig`` is the id, serial number or name of a registered rig, or an address.
    ``warm_up`` is played, and not recorded, while the damper is too cold for the next test's gate. ``interlocks`` are
    texts as :func:`rigctl.interlocks.interlock` reads them, for example ``force:-8e3:8e3:stop:0.01``. ``envelopes`` are
    tables as in a RIG.toml: what the rig and the specimen can do, beside those that the service was started with. The
    other keys travel in the run files; ``calibrations`` are records as in a calibration file, none of them expired.

    Raises Refused, which lists everything that is wrong.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    name: str
    rig: str
    specimen: str
    tests: list[TestConfig] = field(default_factory=list, repr=False)  # any JSON: excitation checks it
    design: str = ""  # id or name of a stored design, instead of tests and warm_up
    warm_up: TestConfig | None = field(default=None, repr=False)
    interlocks: list[str] = field(default_factory=list)
    envelopes: list[EnvelopeConfig] = field(default_factory=list, repr=False)  # any JSON: excitation checks it
    operator: str = ""
    specimen_serial: str = ""
    fixture: str = ""
    oil: str = ""
    calibrations: list[dict[str, Any]] = field(default_factory=list, repr=False)  # any JSON: rigctl checks it

    def __post_init__(self) -> None:
        found = Findings()
        for key, longest in (("name", 200), ("specimen", 200), ("rig", 500), *((key, 200) for key in TEXTS)):
            if getattr(self, key) or key not in TEXTS:
                with found.at(key):
                    check_text(key, getattr(self, key), longest)
        with found.at("rig"):
            self._check_rig()
        self._check_interlocks(found)
        with found.at("calibrations"):
            check_valid(calibrations_from(self.calibrations), datetime.now(UTC).date())
        self._check_tests(found)
        found.refuse()

    def _check_rig(self) -> None:
        if self.rig.endswith(".toml"):  # a client must not choose which files of this computer are read
            raise InputError(f"rig is {self.rig!r}: the map of a controller is for the command line, give an address")
        if "://" in self.rig:
            check_address(canonical_address(self.rig))

    def _check_interlocks(self, found: Findings) -> None:
        with found.at("interlocks"):
            if len(self.interlocks) > _MOST_INTERLOCKS:
                raise InputError(f"interlocks has {len(self.interlocks)} entries: at most {_MOST_INTERLOCKS}")
            for number, text in enumerate(self.interlocks):
                with found.at("interlocks", number):
                    check_text("interlock", text, 100)
                    interlock(text)

    def _check_tests(self, found: Findings) -> None:
        before = len(found.found)
        with found.at("tests"):
            if self.design:
                check_text("design", self.design, 200)
                if self.tests or self.warm_up is not None:
                    raise InputError("design and tests are given: the tests come from one of them")
                return
            if not 0 < len(self.tests) <= _MOST_TESTS:
                raise InputError(
                    f"tests has {len(self.tests)} entries or is missing: a campaign has 1 … {_MOST_TESTS}, or a design"
                )
            for number, config in enumerate(self.tests):
                with found.at("tests", number):
                    check_reads_no_file(config)
        with found.at("envelopes"):
            if len(self.envelopes) > _MOST_ENVELOPES:
                raise InputError(f"envelopes has {len(self.envelopes)} entries: at most {_MOST_ENVELOPES}")
        if len(found.found) == before and not self.plays_samples:
            with found.at():
                self._check_plan(self.plan, found)

    def _check_plan(self, plan: TestPlan, found: Findings) -> None:
        for number, test in enumerate(plan.tests):
            with found.at("tests", number, "name"):
                check_text("test name", test.name, 200)
        if plan.duration_s > _MOST_RIG_TIME_S:
            raise InputError(
                f"tests take {plan.duration_s:.3g} s of rig time: at most {_MOST_RIG_TIME_S:g} s a campaign"
            )
        for number, table in enumerate(self.envelopes):
            with found.at("envelopes", number):
                note_excesses(plan, to_spec(Envelope, table, f"envelopes[{number}]"), found)

    @property
    def prepared(self) -> dict[str, Any]:
        """What is in the rig, as JSON, without what was not given. Any: JSON."""
        return {key: value for key in (*TEXTS, "calibrations") if (value := getattr(self, key))}

    @property
    def own_envelopes(self) -> tuple[Envelope, ...]:
        return tuple(to_spec(Envelope, table, f"envelopes[{n}]") for n, table in enumerate(self.envelopes))

    @property
    def plays_samples(self) -> bool:
        """Whether a test plays stored samples: then its plan is not checked before they are read."""
        return any(map(plays_samples, (*self.tests, self.warm_up or {})))

    @cached_property
    def plan(self) -> TestPlan:
        """Of tests that are all designed."""
        return plan_of(self.tests, self.warm_up)

    def planned(self, make: MakeExcitation) -> TestPlan:
        """The plan, with samples as ``make`` reads them; raises Refused, which lists everything that is wrong."""
        if not self.plays_samples:
            return self.plan
        found = Findings()
        with found.at():
            plan = plan_of(self.tests, self.warm_up, make)
            self._check_plan(plan, found)
        found.refuse()
        return plan


def plan_of(
    tests: Sequence[Mapping[str, Any]],
    warm_up: Mapping[str, Any] | None,
    make: MakeExcitation = excitation_from_config,
) -> TestPlan:
    """The plan of tests that somebody has sent. Any: JSON.

    Raises DesignError, and InputError where the warm-up would read a file of this computer.
    """
    if warm_up is not None:
        check_reads_no_file(warm_up)
    return plan_from_config({"tests": list(tests), **({} if warm_up is None else {"warm_up": dict(warm_up)})}, make)


def note_excesses(plan: TestPlan, envelope: Envelope, found: Findings) -> None:
    """Note every test that exceeds an envelope."""
    for number, error in predict_plan(plan, envelope)[1].items():
        found.add(("tests", number), error)


def check_reads_no_file(config: Mapping[str, Any]) -> None:
    """Raise InputError where a test would read a file of this computer. Any: JSON."""
    if reads_a_file(config):
        raise InputError(
            f"test {config.get('name')!r:.60}: its record names a file: design it at the command line and upload the "
            "file of samples, or give a spectrum's frequency and amplitude"
        )
