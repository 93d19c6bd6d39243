"""Controllers of other makes: maps that are data, the ways of driving them, and one transport for all."""
