"""What a worker writes: only under the lease of its rig, so that two never drive one rig or tell two stories."""

from __future__ import annotations

from sqlalchemy import Connection, insert, select, update
from sqlalchemy.exc import IntegrityError

from api.campaigns.orders import Asked, Order
from api.campaigns.records import Campaign, CampaignState, Lease, RunRecord, TestState
from api.campaigns.store import Store, end_campaign, read_campaign, record_event
from api.errors import LeaseLost, StoreError
from api.store.database import writing
from api.store.tables import campaigns, leases, runs, tests

__all__ = ["Leased", "acquire"]


def acquire(store: Store, rig: str, owner: str, lease_s: float) -> Leased | None:
    """The lease on a rig where nobody holds it or its holder gave no sign of life in time; else None."""
    now = store.clock()
    try:
        with writing(store.engine) as connection:
            row = connection.execute(select(leases).where(leases.c.rig == rig).with_for_update()).one_or_none()
            if row is not None and row.expires_at_s > now:
                return None
            lease = Lease(rig=rig, owner=owner, token=1 if row is None else row.token + 1)
            values = {"owner": owner, "token": lease.token, "expires_at_s": now + lease_s}
            if row is None:
                connection.execute(insert(leases).values(rig=rig, **values))
            else:
                connection.execute(update(leases).where(leases.c.rig == rig).values(**values))
    except StoreError as error:
        if isinstance(error.__cause__, IntegrityError):  # another worker was first, between look and insert
            return None
        raise
    return Leased(store, lease, lease_s)


class Leased:
    """The store in the hands of the one worker that holds a rig's lease.

    Every call renews the lease, and raises LeaseLost where another worker has taken the rig: nothing is
    written then. A lease that ran out but that nobody took is still held.
    """

    def __init__(self, store: Store, lease: Lease, lease_s: float) -> None:
        self.store = store
        self.lease = lease
        self.lease_s = lease_s

    def release(self) -> None:
        """Give the rig back; another worker may take it at once. Silent where it is lost already."""
        with writing(self.store.engine) as connection:
            connection.execute(
                update(leases)
                .where(leases.c.rig == self.lease.rig, leases.c.token == self.lease.token)
                .values(expires_at_s=0.0)
            )

    def left_open(self) -> tuple[Campaign, ...]:
        """What runs on this rig in the store though no worker can be playing it: its worker died."""
        mine = (campaigns.c.rig == self.lease.rig) & (campaigns.c.state == CampaignState.RUNNING)
        with writing(self.store.engine) as connection:
            self._hold(connection, self.store.clock())
            numbers = connection.scalars(select(campaigns.c.number).where(mine)).all()
            return tuple(read_campaign(connection, campaigns.c.number == number) for number in numbers)

    def take_next(self) -> Campaign | None:
        """The campaign of this rig that has waited longest, now running; None where none waits."""
        now = self.store.clock()
        waiting = (campaigns.c.rig == self.lease.rig) & (campaigns.c.state == CampaignState.ACCEPTED)
        with writing(self.store.engine) as connection:
            self._hold(connection, now)
            query = select(campaigns.c.number).where(waiting).order_by(campaigns.c.number).limit(1)
            number = connection.scalar(query.with_for_update())
            if number is None:
                return None
            connection.execute(
                update(campaigns)
                .where(campaigns.c.number == number)
                .values(state=CampaignState.RUNNING, started_at_s=now)
            )
            record_event(connection, number, now, f"taken by {self.lease.owner}")
            return read_campaign(connection, campaigns.c.number == number)

    def sign_of_life(self, campaign: Campaign) -> Order:
        """Renew the lease; what somebody has asked of the campaign."""
        with writing(self.store.engine) as connection:
            self._hold(connection, self.store.clock())
            return _order(connection, campaign)

    def progress(self, campaign: Campaign, position: int, phase: str, samples: int, text: str) -> Order:
        """Write down how far a running test is; what somebody has asked of the campaign."""
        with writing(self.store.engine) as connection:
            self._hold(connection, self.store.clock())
            connection.execute(
                update(tests)
                .where(tests.c.campaign == campaign.number, tests.c.position == position)
                .values(state=TestState.RUNNING, phase=phase, samples=samples, text=text)
            )
            return _order(connection, campaign)

    def end_test(self, campaign: Campaign, position: int, state: TestState, text: str) -> None:
        """How a test ended."""
        now = self.store.clock()
        name = campaign.tests[position].name
        with writing(self.store.engine) as connection:
            self._hold(connection, now)
            connection.execute(
                update(tests)
                .where(tests.c.campaign == campaign.number, tests.c.position == position)
                .values(state=state, phase="", text=text)
            )
            record_event(connection, campaign.number, now, f"test {name}: {state}" + (f": {text}" if text else ""))

    def add_run(self, campaign: Campaign, run: RunRecord) -> None:
        """A captured run file: its samples are what its test has come to."""
        now = self.store.clock()
        with writing(self.store.engine) as connection:
            self._hold(connection, now)
            connection.execute(
                insert(runs).values(
                    id=run.id,
                    campaign=campaign.number,
                    test=run.test,
                    held_out=run.held_out,
                    status=run.status,
                    location=run.location,
                    size_bytes=run.size_bytes,
                    sha256=run.sha256,
                    samples=run.samples,
                    sample_rate_hz=run.sample_rate_hz,
                    created=run.created,
                )
            )
            connection.execute(
                update(tests)
                .where(tests.c.campaign == campaign.number, tests.c.name == run.test)
                .values(samples=run.samples)
            )
            record_event(
                connection,
                campaign.number,
                now,
                f"run {run.id} of test {run.test}: {run.status}, {run.samples} samples",
            )

    def end(self, campaign: Campaign, state: CampaignState, reason: str) -> None:
        """How the campaign ended."""
        now = self.store.clock()
        with writing(self.store.engine) as connection:
            self._hold(connection, now)
            end_campaign(connection, campaign.number, state, reason, now)

    def _hold(self, connection: Connection, now: float) -> None:
        """Renew the lease first of all: its row stays locked until this transaction has ended."""
        held = connection.execute(
            update(leases)
            .where(leases.c.rig == self.lease.rig, leases.c.token == self.lease.token)
            .values(expires_at_s=now + self.lease_s)
        )
        if held.rowcount != 1:
            raise LeaseLost(f"rig {self.lease.rig}: another worker holds its lease by now")


def _order(connection: Connection, campaign: Campaign) -> Order:
    columns = select(campaigns.c.asked, campaigns.c.abort_reason)
    row = connection.execute(columns.where(campaigns.c.number == campaign.number)).one()
    return Order(asked=Asked(row.asked), reason=row.abort_reason)
