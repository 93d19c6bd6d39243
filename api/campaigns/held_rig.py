"""Writes of the worker of a rig, only under the lease of the rig, so that no two workers drive one rig."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import asdict, replace

from sqlalchemy import Connection, insert, select, update

from api.campaigns.orders import ENDS, Asked, Order, combine
from api.campaigns.questions import ask_question, close_question, given_answer
from api.campaigns.queues import in_order, may_start, pause_after_restart, pause_queue
from api.campaigns.records import Campaign, CampaignState, TestState
from api.campaigns.rigs import Rig, ensure_rig, read_rig, set_rig, store_identity
from api.campaigns.store import end_campaign, read_campaign, record_event, rig_resource, wait_again
from api.store.clock import now
from api.store.database import Database
from api.store.leases import Lease, acquire, release, writing_as_holder
from api.store.runs import RunRecord
from api.store.tables import campaigns, leases, rigs, runs, tests
from rigctl.transport import Identity

__all__ = ["HeldRig", "hold_rig"]


def hold_rig(database: Database, rig: str, owner: str, lease_s: float) -> HeldRig | None:
    """The rig, held by ``owner``; None where another worker holds it. The lease of a dead one is taken over.

    ``rig`` is its id, address, serial number or name; raises InputError where there is none.
    """
    with database.writing() as connection:
        found = ensure_rig(connection, rig)
        lease = acquire(connection, database.sightings, rig_resource(found.key), owner, lease_s)
    return None if lease is None else HeldRig(database, found.id, lease)


class HeldRig:
    """The campaigns of one rig, for the one worker that holds its lease.

    Every call renews the lease. It raises LeaseLost, and writes nothing, where another worker has taken the rig. A
    lease that is renewed late is still held as long as no other worker has taken it.
    """

    def __init__(self, database: Database, rig_id: str, lease: Lease) -> None:
        self.lease = lease
        self._database, self.rig_id = database, rig_id

    def rig(self) -> Rig:
        """The rig as it is registered now."""
        with self._database.reading() as connection:
            return read_rig(connection, self.rig_id)

    def identified(self, identity: Identity) -> None:
        """Store who answered at the rig's address; from then on the lease is on its serial number.

        Raises Conflict where it is another rig than the registered one, or one that is registered under two addresses.
        """
        with writing_as_holder(self._database, self.lease) as connection:
            key = store_identity(connection, read_rig(connection, self.rig_id), identity)
            renamed = replace(self.lease, resource=rig_resource(key))
            mine = (leases.c.resource == self.lease.resource) & (leases.c.token == self.lease.token)
            connection.execute(update(leases).where(mine).values(resource=renamed.resource))
        self.lease = renamed

    def note_state(self, state: str, text: str) -> None:
        """Store what the rig says of itself."""
        with writing_as_holder(self._database, self.lease) as connection:
            set_rig(connection, self.rig_id, state=state, state_text=text, state_at_s=now())

    def pause(self, reason: str) -> None:
        """Pause the queue."""
        with writing_as_holder(self._database, self.lease) as connection:
            pause_queue(connection, self.rig_id, reason)

    def pause_after_restart(self, why: str) -> None:
        """Pause the queue where campaigns wait, and keep the reason for which it was paused before."""
        with writing_as_holder(self._database, self.lease) as connection:
            pause_after_restart(connection, read_rig(connection, self.rig_id), why)

    def release(self) -> None:
        """Release the rig; another worker may take it at once. No error if it is lost already."""
        with self._database.writing() as connection:
            release(connection, self.lease)

    def left_open(self) -> tuple[Campaign, ...]:
        """The campaigns of this rig that the store has as running although their worker has died."""
        mine = (campaigns.c.rig_id == self.rig_id) & (campaigns.c.state == CampaignState.RUNNING)
        with writing_as_holder(self._database, self.lease) as connection:
            numbers = connection.scalars(select(campaigns.c.number).where(mine)).all()
            return tuple(read_campaign(connection, campaigns.c.number == number) for number in numbers)

    def own(self, ids: Collection[str]) -> tuple[Campaign, ...]:
        """Those of these campaigns that are on this rig."""
        mine = (campaigns.c.rig_id == self.rig_id) & campaigns.c.id.in_(ids)
        with self._database.reading() as connection:
            numbers = connection.scalars(select(campaigns.c.number).where(mine)).all()
            return tuple(read_campaign(connection, campaigns.c.number == number) for number in numbers)

    def take_next(self) -> Campaign | None:
        """The first campaign in the queue of this rig, now running; None where none may start."""
        joined = select(campaigns.c.number).join(rigs, campaigns.c.rig_id == rigs.c.id)
        waiting = joined.where((campaigns.c.rig_id == self.rig_id) & may_start()).order_by(*in_order()).limit(1)
        with writing_as_holder(self._database, self.lease) as connection:
            number = connection.scalar(waiting.with_for_update())
            if number is None:
                return None
            connection.execute(
                update(campaigns)
                .where(campaigns.c.number == number)
                .values(state=CampaignState.RUNNING, started_at_s=now())
            )
            record_event(connection, number, f"taken by {self.lease.owner}")
            return read_campaign(connection, campaigns.c.number == number)

    def renew(self, campaign: Campaign) -> Order:
        """Renew the lease; returns what was requested of the campaign."""
        with writing_as_holder(self._database, self.lease) as connection:
            return _order(connection, campaign)

    def note_order(self, campaign: Campaign, asked: Asked, reason: str) -> None:
        """Store an order that came over the line; one in the store that goes further stays."""
        with writing_as_holder(self._database, self.lease) as connection:
            before = _order(connection, campaign)
            after = combine(before.asked, asked) or before.asked
            values = {"asked": after, "abort_reason": before.reason or reason}
            connection.execute(update(campaigns).where(campaigns.c.number == campaign.number).values(**values))
            record_event(connection, campaign.number, f"{asked} asked for: {reason}")

    def has_work(self) -> bool:
        """Whether a campaign waits that may start. Renews nothing."""
        joined = select(campaigns.c.number).join(rigs, campaigns.c.rig_id == rigs.c.id)
        with self._database.reading() as connection:
            waiting = joined.where((campaigns.c.rig_id == self.rig_id) & may_start()).limit(1)
            return connection.scalar(waiting) is not None

    def keep(self) -> None:
        """Renew the lease."""
        with writing_as_holder(self._database, self.lease):
            return

    def progress(self, campaign: Campaign, position: int, phase: str, samples: int, text: str) -> Order:
        """Store the progress of a test; returns what was requested of the campaign."""
        with writing_as_holder(self._database, self.lease) as connection:
            connection.execute(
                update(tests)
                .where(tests.c.campaign == campaign.number, tests.c.position == position)
                .values(state=TestState.RUNNING, phase=phase, samples=samples, text=text)
            )
            return _order(connection, campaign)

    def ask(self, campaign: Campaign, question: str) -> None:
        """Store a question to the operator."""
        with writing_as_holder(self._database, self.lease) as connection:
            ask_question(connection, campaign.number, question)
            record_event(connection, campaign.number, f"asks the operator: {question}")

    def answer(self, campaign: Campaign) -> str | None:
        """The operator's answer, as soon as there is one."""
        with writing_as_holder(self._database, self.lease) as connection:
            return given_answer(connection, campaign.number)

    def close_question(self, campaign: Campaign) -> None:
        with writing_as_holder(self._database, self.lease) as connection:
            close_question(connection, campaign.number)

    def end_test(self, campaign: Campaign, position: int, state: TestState, text: str) -> None:
        """Store how a test ended."""
        name = campaign.tests[position].name
        with writing_as_holder(self._database, self.lease) as connection:
            connection.execute(
                update(tests)
                .where(tests.c.campaign == campaign.number, tests.c.position == position)
                .values(state=state, phase="", text=text)
            )
            record_event(connection, campaign.number, f"test {name}: {state}" + (f": {text}" if text else ""))

    def add_run(self, campaign: Campaign, run: RunRecord) -> None:
        """Store a captured run file; the samples of its test are those of the file."""
        with writing_as_holder(self._database, self.lease) as connection:
            values = {name: value for name, value in asdict(run).items() if name != "campaign_id"}
            connection.execute(insert(runs).values(campaign=campaign.number, **values))
            connection.execute(
                update(tests)
                .where(tests.c.campaign == campaign.number, tests.c.name == run.test)
                .values(samples=run.samples)
            )
            text = f"run {run.id} of test {run.test}: {run.status}, {run.samples} samples"
            record_event(connection, campaign.number, text)

    def end(self, campaign: Campaign, state: CampaignState, reason: str, *, pauses: bool) -> None:
        """Store how the campaign ended; ``pauses``: no other starts on its rig until somebody resumes the queue.

        A request that the campaign was too late for pauses the queue too: the operator wanted the rig at rest.
        """
        with writing_as_holder(self._database, self.lease) as connection:
            asked = _order(connection, campaign).asked
            end_campaign(connection, campaign.number, state, reason)
            if pauses or asked is not Asked.NOTHING:
                why = reason or f"{asked} was asked for while it ended"
                pause_queue(connection, self.rig_id, f"campaign {campaign.name!r}: {why}")

    def put_back(self, campaign: Campaign, reason: str) -> None:
        """Let a campaign wait again, in its place, and pause the queue; one that was asked to end is aborted."""
        with writing_as_holder(self._database, self.lease) as connection:
            order = _order(connection, campaign)
            if order.asked in ENDS:
                end_campaign(connection, campaign.number, CampaignState.ABORTED, order.reason or str(order.asked))
            else:
                wait_again(connection, campaign.number, reason)
            pause_queue(connection, self.rig_id, f"campaign {campaign.name!r} waits: {reason}")


def _order(connection: Connection, campaign: Campaign) -> Order:
    columns = select(campaigns.c.asked, campaigns.c.abort_reason)
    row = connection.execute(columns.where(campaigns.c.number == campaign.number)).one()
    return Order(asked=Asked(row.asked), reason=row.abort_reason)
