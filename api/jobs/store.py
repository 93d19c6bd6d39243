"""Explanations in the campaign store: accepted, taken by one service at a time, and ended as they ended."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from uuid import uuid4

from sqlalchemy import Connection, Row, insert, select, update

from api.campaigns.records import Explanation, ExplanationState, RunRecord, Upload
from api.campaigns.store import Store
from api.errors import Conflict, LeaseLost, NotFound
from api.store.database import reading, writing
from api.store.tables import campaigns, explanations, runs, uploads

__all__ = ["LEFT_OPEN", "ExplanationStore"]

LEFT_OPEN = "the service that worked on it gave no sign of life in time: ask for it again"


class ExplanationStore:
    """A view of the store. Safe to use from many threads; every call is one transaction."""

    def __init__(self, store: Store) -> None:
        self._engine, self._clock = store.engine, store.clock

    def create(
        self, *, name: str, campaign_id: str, model: dict[str, Any] | None, runs: Sequence[str], held_out: Sequence[str]
    ) -> Explanation:
        """Accept one: from now on it is never lost. Any: the JSON of a model file."""
        row = insert(explanations).values(
            id=uuid4().hex,
            name=name,
            campaign=campaign_id or None,
            model=model,
            runs=list(runs),
            held_out=list(held_out),
            state=ExplanationState.ACCEPTED,
            phase="",
            done=0.0,
            reason="",
            verdict="",
            effects=[],
            owner="",
            expires_at_s=0.0,
            created_at_s=self._clock(),
        )
        with writing(self._engine) as connection:
            return _read(connection, connection.scalars(row.returning(explanations.c.id)).one())

    def one(self, explanation_id: str) -> Explanation:
        """One explanation; raises NotFound."""
        with reading(self._engine) as connection:
            return _read(connection, explanation_id)

    def newest(self, *, limit: int = 50, before: int | None = None, campaign_id: str = "") -> tuple[Explanation, ...]:
        """The newest first; ``before``: only those accepted before that number."""
        query = select(explanations).order_by(explanations.c.number.desc()).limit(limit)
        if before is not None:
            query = query.where(explanations.c.number < before)
        if campaign_id:
            query = query.where(explanations.c.campaign == campaign_id)
        with reading(self._engine) as connection:
            return tuple(_explanation(row) for row in connection.execute(query))

    def cancel(self, explanation_id: str, reason: str) -> Explanation:
        """Ask for its end: at once where it waits, by its worker where it runs.

        Raises NotFound, and Conflict where it has ended in another way.
        """
        with writing(self._engine) as connection:
            query = select(explanations).where(explanations.c.id == explanation_id).with_for_update()
            row = connection.execute(query).one_or_none()
            if row is None:
                raise _unknown(explanation_id)
            match ExplanationState(row.state):
                case ExplanationState.ACCEPTED:
                    self._end(connection, row.id, ExplanationState.CANCELLED, reason)
                case ExplanationState.RUNNING:
                    _set(connection, row.id, cancel_reason=reason)
                case ExplanationState.DONE | ExplanationState.FAILED:
                    raise Conflict(f"explanation {explanation_id} is {row.state}: it can be cancelled no more")
            return _read(connection, explanation_id)

    def close_left_open(self) -> None:
        """End as failed what runs in the store though its service is dead."""
        now = self._clock()
        dead = (explanations.c.state == ExplanationState.RUNNING) & (explanations.c.expires_at_s < now)
        with reading(self._engine) as connection:
            if connection.scalar(select(explanations.c.id).where(dead).limit(1)) is None:
                return
        with writing(self._engine) as connection:
            connection.execute(
                update(explanations)
                .where(dead)
                .values(state=ExplanationState.FAILED, reason=LEFT_OPEN, phase="", ended_at_s=now)
            )

    def take_next(self, owner: str, lease_s: float) -> Explanation | None:
        """The one that has waited longest, now running here; None where none waits."""
        waiting = select(explanations.c.id).where(explanations.c.state == ExplanationState.ACCEPTED)
        first = waiting.order_by(explanations.c.number).limit(1)
        with reading(self._engine) as connection:
            if connection.scalar(first) is None:
                return None
        now = self._clock()
        with writing(self._engine) as connection:
            found = connection.scalar(first.with_for_update(skip_locked=True))
            if found is None:
                return None
            _set(
                connection,
                found,
                state=ExplanationState.RUNNING,
                owner=owner,
                expires_at_s=now + lease_s,
                started_at_s=now,
            )
            return _read(connection, found)

    def sign_of_life(self, explanation_id: str, owner: str, lease_s: float, phase: str, done: float) -> str | None:
        """Write down how far it is; the reason where somebody has asked for its end. Raises LeaseLost."""
        with writing(self._engine) as connection:
            _held(connection, explanation_id, owner, expires_at_s=self._clock() + lease_s, phase=phase, done=done)
            query = select(explanations.c.cancel_reason).where(explanations.c.id == explanation_id)
            return connection.scalar(query)

    def end(
        self,
        explanation_id: str,
        owner: str,
        state: ExplanationState,
        reason: str = "",
        *,
        verdict: str = "",
        effects: Sequence[tuple[str, float]] = (),
    ) -> None:
        """How it ended. Raises LeaseLost where this owner has lost it."""
        found = {"verdict": verdict, "effects": [list(effect) for effect in effects]}
        with writing(self._engine) as connection:
            _held(connection, explanation_id, owner, **found)
            self._end(connection, explanation_id, state, reason)

    def give_back(self, explanation_id: str, owner: str) -> None:
        """Let another service, or this one when it is up again, begin it anew. Raises LeaseLost."""
        with writing(self._engine) as connection:
            _held(
                connection,
                explanation_id,
                owner,
                state=ExplanationState.ACCEPTED,
                phase="",
                done=0.0,
                started_at_s=None,
            )

    def keep_upload(self, upload: Upload) -> None:
        """Take note of a run file that came from elsewhere."""
        values = {name: getattr(upload, name) for name in Upload.__slots__}
        with writing(self._engine) as connection:
            connection.execute(insert(uploads).values(**values, created_at_s=self._clock()))

    def upload(self, upload_id: str) -> Upload:
        """One uploaded run file; raises NotFound."""
        with reading(self._engine) as connection:
            return _upload(connection, upload_id)

    def locations(self, ids: Sequence[str]) -> tuple[str, ...]:
        """Where the captured or uploaded runs of these ids are kept; raises NotFound."""
        with reading(self._engine) as connection:
            return tuple(_location(connection, run_id) for run_id in ids)

    def complete_runs(self, *, campaign_id: str = "", rig: str = "", specimen: str = "") -> tuple[RunRecord, ...]:
        """Every complete run of a campaign, or of a rig and there of one specimen, in the order of capture."""
        query = select(runs, campaigns.c.id.label("campaign_id")).join(campaigns).where(runs.c.status == "complete")
        for column, value in ((campaigns.c.id, campaign_id), (campaigns.c.rig, rig), (campaigns.c.specimen, specimen)):
            if value:
                query = query.where(column == value)
        with reading(self._engine) as connection:
            rows = connection.execute(query.order_by(runs.c.created, runs.c.id)).all()
            return tuple(RunRecord(**{n: getattr(row, n) for n in RunRecord.__slots__}) for row in rows)

    def _end(self, connection: Connection, explanation_id: str, state: ExplanationState, reason: str) -> None:
        done = {"done": 1.0} if state is ExplanationState.DONE else {}
        _set(connection, explanation_id, state=state, reason=reason, phase="", ended_at_s=self._clock(), **done)


def _held(connection: Connection, explanation_id: str, owner: str, **values: object) -> None:
    mine = (
        (explanations.c.id == explanation_id)
        & (explanations.c.owner == owner)
        & (explanations.c.state == ExplanationState.RUNNING)
    )
    if connection.execute(update(explanations).where(mine).values(**values)).rowcount != 1:
        raise LeaseLost(f"explanation {explanation_id}: this service has lost it")


def _set(connection: Connection, explanation_id: str, **values: object) -> None:
    connection.execute(update(explanations).where(explanations.c.id == explanation_id).values(**values))


def _unknown(explanation_id: str) -> NotFound:
    return NotFound(f"there is no explanation {explanation_id!r:.60}: GET /v1/explanations lists them")


def _read(connection: Connection, explanation_id: str) -> Explanation:
    row = connection.execute(select(explanations).where(explanations.c.id == explanation_id)).one_or_none()
    if row is None:
        raise _unknown(explanation_id)
    return _explanation(row)


def _explanation(row: Row[Any]) -> Explanation:
    # Any: SQLAlchemy's rows know their columns only when they run
    return Explanation(
        number=row.number,
        id=row.id,
        name=row.name,
        campaign_id=row.campaign or "",
        model=row.model,
        runs=tuple(row.runs),
        held_out=tuple(row.held_out),
        state=ExplanationState(row.state),
        phase=row.phase,
        done=row.done,
        reason=row.reason,
        verdict=row.verdict,
        effects=tuple((name, confidence) for name, confidence in row.effects),
        created_at_s=row.created_at_s,
        started_at_s=row.started_at_s,
        ended_at_s=row.ended_at_s,
    )


def _upload(connection: Connection, upload_id: str) -> Upload:
    row = connection.execute(select(uploads).where(uploads.c.id == upload_id)).one_or_none()
    if row is None:
        raise NotFound(f"there is no run {upload_id!r:.60}: POST /v1/runs takes one, or give that of a campaign")
    return Upload(**{name: getattr(row, name) for name in Upload.__slots__})


def _location(connection: Connection, run_id: str) -> str:
    captured = connection.scalar(select(runs.c.location).where(runs.c.id == run_id))
    return _upload(connection, run_id).location if captured is None else str(captured)
