"""Writes of the worker of a rig, only under the lease of the rig, so that no two workers drive one rig."""

from __future__ import annotations

from dataclasses import asdict

from sqlalchemy import Connection, insert, select, update

from api.campaigns.orders import Asked, Order
from api.campaigns.records import Campaign, CampaignState, TestState
from api.campaigns.store import end_campaign, read_campaign, record_event, rig_resource
from api.store.clock import now
from api.store.database import Database
from api.store.leases import Lease, acquire, release, writing_as_holder
from api.store.runs import RunRecord
from api.store.tables import campaigns, runs, tests

__all__ = ["HeldRig", "hold_rig"]


def hold_rig(database: Database, rig: str, owner: str, lease_s: float) -> HeldRig | None:
    """The rig, held by ``owner``; None where another worker holds it. An expired lease is taken over."""
    with database.writing() as connection:
        lease = acquire(connection, rig_resource(rig), owner, lease_s)
    return None if lease is None else HeldRig(database, rig, lease)


class HeldRig:
    """The campaigns of one rig, for the one worker that holds its lease.

    Every call renews the lease. It raises LeaseLost, and writes nothing, where another worker has taken the rig. A
    lease that expired is still held as long as no other worker takes it.
    """

    def __init__(self, database: Database, rig: str, lease: Lease) -> None:
        self.lease = lease
        self._database, self._rig = database, rig

    def release(self) -> None:
        """Release the rig; another worker may take it at once. No error if it is lost already."""
        with self._database.writing() as connection:
            release(connection, self.lease)

    def left_open(self) -> tuple[Campaign, ...]:
        """The campaigns of this rig that the store has as running although their worker has died."""
        mine = (campaigns.c.rig == self._rig) & (campaigns.c.state == CampaignState.RUNNING)
        with writing_as_holder(self._database, self.lease) as connection:
            numbers = connection.scalars(select(campaigns.c.number).where(mine)).all()
            return tuple(read_campaign(connection, campaigns.c.number == number) for number in numbers)

    def take_next(self) -> Campaign | None:
        """The campaign of this rig that has waited longest, now running; None where none waits."""
        waiting = (campaigns.c.rig == self._rig) & (campaigns.c.state == CampaignState.ACCEPTED)
        with writing_as_holder(self._database, self.lease) as connection:
            query = select(campaigns.c.number).where(waiting).order_by(campaigns.c.number).limit(1)
            number = connection.scalar(query.with_for_update())
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

    def progress(self, campaign: Campaign, position: int, phase: str, samples: int, text: str) -> Order:
        """Store the progress of a test; returns what was requested of the campaign."""
        with writing_as_holder(self._database, self.lease) as connection:
            connection.execute(
                update(tests)
                .where(tests.c.campaign == campaign.number, tests.c.position == position)
                .values(state=TestState.RUNNING, phase=phase, samples=samples, text=text)
            )
            return _order(connection, campaign)

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

    def end(self, campaign: Campaign, state: CampaignState, reason: str) -> None:
        """Store how the campaign ended."""
        with writing_as_holder(self._database, self.lease) as connection:
            end_campaign(connection, campaign.number, state, reason)


def _order(connection: Connection, campaign: Campaign) -> Order:
    columns = select(campaigns.c.asked, campaigns.c.abort_reason)
    row = connection.execute(columns.where(campaigns.c.number == campaign.number)).one()
    return Order(asked=Asked(row.asked), reason=row.abort_reason)
