"""The naming workflow judged on hidden cases: `make bench-explain`."""
