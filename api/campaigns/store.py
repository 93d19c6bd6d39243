"""Campaigns in the store: requests, progress and results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from uuid import uuid4

from sqlalchemy import ColumnElement, Connection, Row, Select, func, select, update

from api.campaigns.new_campaign import NewCampaign
from api.campaigns.orders import ENDS, Asked, combine
from api.campaigns.records import Campaign, CampaignState, CampaignTest, Event, RigRecord, TestState
from api.errors import Conflict
from api.store.campaign_numbers import campaign_number, unknown_campaign
from api.store.clock import now
from api.store.database import Database
from api.store.leases import holders
from api.store.tables import campaigns, events, tests

__all__ = ["OPEN_STATES", "CampaignStore", "end_campaign", "read_campaign", "record_event", "rig_resource"]

OPEN_STATES = (CampaignState.ACCEPTED, CampaignState.RUNNING)


class CampaignStore:
    """Campaigns in the database. Safe to use from many threads; every call is one transaction."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def create(self, new: NewCampaign) -> Campaign:
        """Store a new campaign."""
        with self._database.writing() as connection:
            row = campaigns.insert().values(
                id=uuid4().hex,
                name=new.name,
                rig=new.rig,
                specimen=new.specimen,
                warm_up=new.warm_up,
                interlocks=new.interlocks,
                state=CampaignState.ACCEPTED,
                reason="",
                created_at_s=now(),
            )
            number = connection.scalars(row.returning(campaigns.c.number)).one()
            connection.execute(tests.insert(), [_test_row(number, k, new) for k in range(len(new.plan.tests))])
            record_event(connection, number, "accepted")
            return read_campaign(connection, campaigns.c.number == number)

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

    def events(self, campaign_id: str) -> tuple[Event, ...]:
        """What happened to a campaign, in order; raises NotFound."""
        with self._database.reading() as connection:
            number = campaign_number(connection, campaign_id)
            rows = connection.execute(select(events).where(events.c.campaign == number).order_by(events.c.number))
            return tuple(Event(number=row.number, at_s=row.at_s, text=row.text) for row in rows)

    def rigs(self) -> tuple[RigRecord, ...]:
        """Every rig that a campaign has named, by its address."""
        waiting = func.sum((campaigns.c.state == CampaignState.ACCEPTED).cast(campaigns.c.number.type))
        query = select(campaigns.c.rig, waiting.label("accepted")).group_by(campaigns.c.rig).order_by(campaigns.c.rig)
        with self._database.reading() as connection:
            workers = holders(connection)
            running = {
                row.rig: row.id
                for row in connection.execute(
                    select(campaigns.c.rig, campaigns.c.id).where(campaigns.c.state == CampaignState.RUNNING)
                )
            }
            return tuple(
                RigRecord(
                    url=row.rig,
                    worker=workers.get(rig_resource(row.rig), ""),
                    running=running.get(row.rig, ""),
                    accepted=int(row.accepted),
                )
                for row in connection.execute(query)
            )

    def rigs_with_work(self) -> tuple[str, ...]:
        """The rigs that have a campaign which has not ended."""
        query = select(campaigns.c.rig).where(campaigns.c.state.in_(OPEN_STATES)).distinct()
        with self._database.reading() as connection:
            return tuple(connection.scalars(query.order_by(campaigns.c.rig)))


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


def rig_resource(rig: str) -> str:
    """The resource of a lease on a rig."""
    return f"rig {rig}"


def record_event(connection: Connection, number: int, text: str) -> None:
    """Store an event of a campaign."""
    connection.execute(events.insert().values(campaign=number, at_s=now(), text=text))


def end_campaign(connection: Connection, number: int, state: CampaignState, reason: str) -> None:
    """End a campaign: a running test ends like the campaign, waiting tests are skipped."""
    _set(connection, number, state=state, reason=reason, asked=Asked.NOTHING, ended_at_s=now())
    last = TestState.ABORTED if state is CampaignState.ABORTED else TestState.FAILED
    for before, after in ((TestState.RUNNING, last), (TestState.WAITING, TestState.SKIPPED)):
        connection.execute(
            update(tests).where(tests.c.campaign == number, tests.c.state == before).values(state=after, phase="")
        )
    record_event(connection, number, f"{state}: {reason}" if reason else str(state))


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


def _campaign(row: Row[Any], of: Sequence[CampaignTest]) -> Campaign:
    return Campaign(
        number=row.number,
        id=row.id,
        name=row.name,
        rig=row.rig,
        specimen=row.specimen,
        warm_up=row.warm_up,
        interlocks=tuple(row.interlocks),
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


def _test_row(number: int, position: int, new: NewCampaign) -> dict[str, Any]:
    test = new.plan.tests[position]
    return {
        "campaign": number,
        "position": position,
        "name": test.name,
        "config": dict(new.tests[position]),
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
