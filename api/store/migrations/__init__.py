"""The store's schema, one step a file; run at the start of every service."""
