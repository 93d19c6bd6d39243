"""The store: its database, its tables and schema steps, leases, and run files."""
