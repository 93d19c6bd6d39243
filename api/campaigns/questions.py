"""The question of a running campaign to its operator, and the answer, in the store."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, Row, select, update

from api.campaigns.records import CampaignState
from api.errors import Conflict
from api.store.tables import campaigns

__all__ = ["ask_question", "close_question", "give_answer", "given_answer"]


def ask_question(connection: Connection, number: int, question: str) -> None:
    """Put a question; the answer to an earlier one is forgotten."""
    connection.execute(update(campaigns).where(campaigns.c.number == number).values(question=question, answer=None))


def give_answer(connection: Connection, row: Row[Any], answer: str, question: str | None) -> None:
    """Answer the question of a campaign; Conflict where it asks nothing, or another question than this one.

    Any: rows know their columns when they run.
    """
    if row.state != CampaignState.RUNNING or not row.question or row.answer is not None:
        raise Conflict(f"campaign {row.id} asks nothing: there is nothing to answer")
    if question is not None and question != row.question:
        raise Conflict(f"campaign {row.id} asks another question by now: {row.question}")
    connection.execute(update(campaigns).where(campaigns.c.number == row.number).values(answer=answer))


def given_answer(connection: Connection, number: int) -> str | None:
    """The answer, as soon as there is one."""
    answer: str | None = connection.scalar(select(campaigns.c.answer).where(campaigns.c.number == number))
    return answer


def close_question(connection: Connection, number: int) -> None:
    connection.execute(update(campaigns).where(campaigns.c.number == number).values(question="", answer=None))
