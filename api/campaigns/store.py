"""Campaigns in the store: requests, progress and results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any
from uuid import uuid4

from sqlalchemy import ColumnElement, Connection, Row, Select, select, update

from api.campaigns.new_campaign import NewCampaign
from api.campaigns.orders import ENDS, Asked, combine
from api.campaigns.questions import give_answer
from api.campaigns.queues import may_start
from api.campaigns.records import Campaign, CampaignState, CampaignTest, Event, TestState
from api.campaigns.rigs import Rig, ensure_rig
from api.errors import Conflict
from api.store.campaign_numbers import campaign_number, unknown_campaign
from api.store.clock import now
from api.store.database import Database
from api.store.many_rows import ManyRows
from api.store.samples import hold_samples
from api.store.tables import campaigns, events, rigs, tests
from excitation import TestPlan

__all__ = [
    "OPEN_STATES",
    "CampaignStore",
    "Placed",
    "end_campaign",
    "insert_campaigns",
    "read_campaign",
    "record_event",
    "rig_resource",
    "wait_again",
]

_ACCEPTED = ManyRows(
    campaigns,
    (
        *("id", "name", "rig", "rig_id", "created_by", "specimen", "warm_up", "setup", "interlocks", "envelopes"),
        *("state", "reason"),
    ),
    computed={"created_at_s": now()},
    returning=("id", "number", "created_at_s"),
)
_TESTS = ManyRows(
    tests,
    (
        *("campaign", "position", "name", "config", "held_out", "duration_s", "state", "phase", "samples"),
        *("total_samples", "text"),
    ),
)
_EVENTS = ManyRows(events, ("campaign", "text"), computed={"at_s": now()})
_FRESH = {"asked": Asked.NOTHING, "question": "", "answer": None, "started_at_s": None, "ended_at_s": None}
OPEN_STATES = (CampaignState.ACCEPTED, CampaignState.RUNNING)


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """A campaign that is to be stored, its plan, and the registered rig that it is for."""

    new: NewCampaign
    plan: TestPlan
    rig: Rig
    created_by: str = ""


class CampaignStore:
    """Campaigns in the database. Safe to use from many threads; every call is one transaction."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def create(self, new: NewCampaign, *, plan: TestPlan | None = None, created_by: str = "") -> Campaign:
        """Store a new campaign; a rig whose address is not registered is registered on the way.

        ``plan``: of a campaign that names samples. Raises InputError where its rig is neither a registered one nor an
        address, and where its samples are not stored.
        """
        with self._database.writing() as connection:
            rig = ensure_rig(connection, new.rig)
            placed = Placed(new=new, plan=plan or new.plan, rig=rig, created_by=created_by)
            return insert_campaigns(connection, [placed])[0]

    def campaign(self, campaign_id: str) -> Campaign:
        """One campaign; raises NotFound."""
        with self._database.reading() as connection:
            return read_campaign(connection, campaigns.c.id == campaign_id, campaign_id)

    def campaigns(
        self, *, limit: int = 50, before: int | None = None, state: CampaignState | None = None
    ) -> tuple[Campaign, ...]:
        """The newest campaigns first; ``before``: only those accepted before that number."""
        query = select(campaigns).order_by(campaigns.c.number.desc()).limit(limit)
        if before is not None:
            query = query.where(campaigns.c.number < before)
        if state is not None:
            query = query.where(campaigns.c.state == state)
        with self._database.reading() as connection:
            return _read_campaigns(connection, query)

    def abort(self, campaign_id: str, reason: str) -> Campaign:
        """Request the end of a campaign, as `ask` does."""
        return self.ask(campaign_id, Asked.ABORT, reason)

    def ask(self, campaign_id: str, wish: Asked, reason: str) -> Campaign:
        """End a campaign: at once where it waits, by its worker where it runs; or hold or resume it.

        Raises NotFound, and Conflict where the campaign is not in a state for that.
        """
        with self._database.writing() as connection:
            query = select(campaigns).where(campaigns.c.id == campaign_id).with_for_update()
            row = connection.execute(query).one_or_none()
            if row is None:
                raise unknown_campaign(campaign_id)
            match CampaignState(row.state):
                case CampaignState.RUNNING:
                    _ask_running(connection, row, wish, reason)
                case CampaignState.ACCEPTED if wish in ENDS:
                    end_campaign(connection, row.number, CampaignState.ABORTED, reason)
                case CampaignState.ABORTED if wish in ENDS:
                    pass
                case _:
                    which = "an accepted or a running one" if wish in ENDS else "a running one"
                    raise Conflict(f"campaign {campaign_id} is {row.state}: only {which} can {_verb(wish)}")
            return read_campaign(connection, campaigns.c.number == row.number)

    def answer(self, campaign_id: str, answer: str, question: str | None = None) -> Campaign:
        """Answer what a running campaign asks its operator.

        Raises NotFound, and Conflict where it asks nothing, or another question than `question`.
        """
        with self._database.writing() as connection:
            query = select(campaigns).where(campaigns.c.id == campaign_id).with_for_update()
            row = connection.execute(query).one_or_none()
            if row is None:
                raise unknown_campaign(campaign_id)
            give_answer(connection, row, answer, question)
            record_event(connection, row.number, f"answered {answer!r}: {row.question}")
            return read_campaign(connection, campaigns.c.number == row.number)

    def events(self, campaign_id: str) -> tuple[Event, ...]:
        """What happened to a campaign, in order; raises NotFound."""
        with self._database.reading() as connection:
            number = campaign_number(connection, campaign_id)
            rows = connection.execute(select(events).where(events.c.campaign == number).order_by(events.c.number))
            return tuple(Event(number=row.number, at_s=row.at_s, text=row.text) for row in rows)

    def delete(self, campaign_id: str) -> None:
        """Delete a campaign that waits; raises NotFound, and Conflict where it has begun or ended."""
        with self._database.writing() as connection:
            query = select(campaigns).where(campaigns.c.id == campaign_id).with_for_update()
            row = connection.execute(query).one_or_none()
            if row is None:
                raise unknown_campaign(campaign_id)
            if row.state != CampaignState.ACCEPTED:
                raise Conflict(f"campaign {campaign_id} is {row.state}: only one that waits can be deleted")
            for table in (tests, events):
                connection.execute(table.delete().where(table.c.campaign == row.number))
            connection.execute(campaigns.delete().where(campaigns.c.number == row.number))

    def retry(self, campaign_id: str, *, created_by: str = "") -> Campaign:
        """A new campaign that repeats one that has ended; raises NotFound, and Conflict where it has not ended.

        Raises InputError where its samples were removed since.
        """
        with self._database.writing() as connection:
            old = read_campaign(connection, campaigns.c.id == campaign_id, campaign_id)
            if old.state in OPEN_STATES:
                raise Conflict(f"campaign {campaign_id} is {old.state}: only one that has ended can be repeated")
            kept = ("name", "rig", "rig_id", "specimen", "warm_up", "interlocks", "envelopes", "setup")
            copied = select(*(campaigns.c[name] for name in kept)).where(campaigns.c.number == old.number)
            values = connection.execute(copied).one()._asdict()
            hold_samples(connection, [values["warm_up"], *(test.config for test in old.tests)])
            fresh = {"id": uuid4().hex, "state": CampaignState.ACCEPTED, "reason": "", "created_by": created_by}
            row = campaigns.insert().values(**values, **fresh, created_at_s=now())
            number = connection.scalars(row.returning(campaigns.c.number)).one()
            connection.execute(tests.insert(), [_again(number, test) for test in old.tests])
            record_event(connection, number, f"accepted: repeats campaign {old.id}")
            return read_campaign(connection, campaigns.c.number == number)

    def rigs_with_work(self) -> tuple[str, ...]:
        """The addresses of the rigs with a campaign that runs, or one that waits and may start."""
        joined = select(rigs.c.address).join(campaigns, campaigns.c.rig_id == rigs.c.id)
        query = joined.where((campaigns.c.state == CampaignState.RUNNING) | may_start()).distinct()
        with self._database.reading() as connection:
            return tuple(connection.scalars(query.order_by(rigs.c.address)))


def insert_campaigns(connection: Connection, placed: Sequence[Placed]) -> list[Campaign]:
    """Store new campaigns, with three statements for all of them; raises InputError where samples are not stored."""
    hold_samples(connection, [config for one in placed for config in (*one.new.tests, one.new.warm_up)])
    rows = [_campaign_row(one) for one in placed]
    made = {row.id: row._asdict() for row in _ACCEPTED.insert(connection, rows)}
    numbers = [made[row["id"]]["number"] for row in rows]
    tests_of = [
        [_test_row(number, position, one) for position in range(len(one.plan.tests))]
        for number, one in zip(numbers, placed, strict=True)
    ]
    _TESTS.insert(connection, [row for of in tests_of for row in of])
    _EVENTS.insert(connection, [{"campaign": number, "text": "accepted"} for number in numbers])
    return [
        _campaign(SimpleNamespace(**_FRESH, **row | made[row["id"]]), [_new_test(test) for test in of])
        for row, of in zip(rows, tests_of, strict=True)
    ]


def _ask_running(connection: Connection, row: Row[Any], wish: Asked, reason: str) -> None:
    """Any: SQLAlchemy's rows know their columns only when they run."""
    after = combine(Asked(row.asked), wish)
    if after is None:
        raise Conflict(f"campaign {row.id} is ending, {row.asked} was asked for: it cannot {_verb(wish)}")
    if after != row.asked:
        _set(connection, row.number, asked=after, abort_reason=reason if after in ENDS else None)
        record_event(connection, row.number, f"{after or 'resume'} asked for: {reason}")


def _verb(wish: Asked) -> str:
    return {Asked.NOTHING: "resume", Asked.ABORT: "be aborted"}.get(wish, str(wish))


def rig_resource(key: str) -> str:
    """The resource of a lease on a rig, by its key: that of its serial number, as soon as it has said it."""
    return f"rig {key}"


def record_event(connection: Connection, number: int, text: str) -> None:
    """Store an event of a campaign."""
    connection.execute(events.insert().values(campaign=number, at_s=now(), text=text))


def end_campaign(connection: Connection, number: int, state: CampaignState, reason: str) -> None:
    """End a campaign: a running test ends like the campaign, waiting tests are skipped."""
    _set(
        connection, number, state=state, reason=reason, asked=Asked.NOTHING, question="", answer=None, ended_at_s=now()
    )
    last = TestState.ABORTED if state is CampaignState.ABORTED else TestState.FAILED
    for before, after in ((TestState.RUNNING, last), (TestState.WAITING, TestState.SKIPPED)):
        connection.execute(
            update(tests).where(tests.c.campaign == number, tests.c.state == before).values(state=after, phase="")
        )
    record_event(connection, number, f"{state}: {reason}" if reason else str(state))


def wait_again(connection: Connection, number: int, reason: str) -> None:
    """Let a campaign that was taken, and has not begun, wait as before."""
    fresh = {
        "state": CampaignState.ACCEPTED,
        "asked": Asked.NOTHING,
        "abort_reason": None,
        "question": "",
        "answer": None,
    }
    _set(connection, number, **fresh, started_at_s=None)
    waiting = {"state": TestState.WAITING, "phase": "", "samples": 0, "text": ""}
    connection.execute(update(tests).where(tests.c.campaign == number).values(**waiting))
    record_event(connection, number, f"waits again: {reason}")


def read_campaign(connection: Connection, where: ColumnElement[bool], name: str = "") -> Campaign:
    """The campaign that ``where`` selects; raises NotFound."""
    found = _read_campaigns(connection, select(campaigns).where(where))
    if not found:
        raise unknown_campaign(name)
    return found[0]


def _read_campaigns(connection: Connection, query: Select[Any]) -> tuple[Campaign, ...]:
    # Any: SQLAlchemy's rows know their columns only when they run
    rows = connection.execute(query).all()
    numbers = [row.number for row in rows]
    of: dict[int, list[CampaignTest]] = {number: [] for number in numbers}
    for row in connection.execute(
        select(tests).where(tests.c.campaign.in_(numbers)).order_by(tests.c.campaign, tests.c.position)
    ):
        of[row.campaign].append(_test(row))
    return tuple(_campaign(row, of[row.number]) for row in rows)


def _campaign(row: Row[Any] | SimpleNamespace, of: Sequence[CampaignTest]) -> Campaign:
    return Campaign(
        number=row.number,
        id=row.id,
        name=row.name,
        rig=row.rig,
        rig_id=row.rig_id,
        created_by=row.created_by,
        specimen=row.specimen,
        setup=row.setup,
        question=row.question if row.answer is None else "",
        warm_up=row.warm_up,
        interlocks=tuple(row.interlocks),
        envelopes=tuple(row.envelopes),
        state=CampaignState(row.state),
        reason=row.reason,
        asked=Asked(row.asked),
        created_at_s=row.created_at_s,
        started_at_s=row.started_at_s,
        ended_at_s=row.ended_at_s,
        tests=tuple(of),
    )


def _test(row: Row[Any]) -> CampaignTest:
    return CampaignTest(
        position=row.position,
        name=row.name,
        config=row.config,
        held_out=row.held_out,
        duration_s=row.duration_s,
        state=TestState(row.state),
        phase=row.phase,
        samples=row.samples,
        total_samples=row.total_samples,
        text=row.text,
    )


def _new_test(row: dict[str, Any]) -> CampaignTest:
    return CampaignTest(**{name: value for name, value in row.items() if name != "campaign"})


def _again(number: int, test: CampaignTest) -> dict[str, Any]:
    same = {name: getattr(test, name) for name in ("position", "name", "held_out", "duration_s", "total_samples")}
    fresh = {"state": TestState.WAITING, "phase": "", "samples": 0, "text": ""}
    return {"campaign": number, "config": dict(test.config), **same, **fresh}


def _campaign_row(placed: Placed) -> dict[str, Any]:
    new = placed.new
    return {
        "id": uuid4().hex,
        "name": new.name,
        "rig": placed.rig.address,
        "rig_id": placed.rig.id,
        "created_by": placed.created_by,
        "specimen": new.specimen,
        "warm_up": new.warm_up,
        "setup": new.prepared,
        "interlocks": new.interlocks,
        "envelopes": new.envelopes,
        "state": CampaignState.ACCEPTED,
        "reason": "",
    }


def _test_row(number: int, position: int, placed: Placed) -> dict[str, Any]:
    test = placed.plan.tests[position]
    return {
        "campaign": number,
        "position": position,
        "name": test.name,
        "config": dict(placed.new.tests[position]),
        "held_out": test.held_out,
        "duration_s": test.excitation.duration_s + test.dwell_s,
        "state": TestState.WAITING,
        "phase": "",
        "samples": 0,
        "total_samples": test.excitation.samples,
        "text": "",
    }


def _set(connection: Connection, number: int, **values: object) -> None:
    connection.execute(update(campaigns).where(campaigns.c.number == number).values(**values))
