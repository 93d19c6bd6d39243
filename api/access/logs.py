"""The log of a process of the service: one line for each event, as text or as JSON, limited and without keys."""

from __future__ import annotations

import json
import logging
import sys
from datetime import UTC, datetime

from api.access.log_limit import LogLimit, Redaction

__all__ = ["JsonLines", "start_log"]


class JsonLines(logging.Formatter):
    """A record as one line of JSON: time (UTC), level, logger, message, and the traceback where there is one."""

    def format(self, record: logging.LogRecord) -> str:
        event = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_info:
            event["traceback"] = self.formatException(record.exc_info)
        return json.dumps(event, ensure_ascii=False)


def start_log(log_format: str) -> None:
    """From now on warnings, errors and the audit log of this process go to standard error: ``text`` or ``json``."""
    text = logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s")
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(Redaction(JsonLines() if log_format == "json" else text))
    handler.addFilter(LogLimit())
    logging.basicConfig(level=logging.WARNING, handlers=[handler])
    logging.getLogger("damper_rig.audit").setLevel(logging.INFO)
