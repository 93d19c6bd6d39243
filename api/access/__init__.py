"""Who may do what: keys and their scopes, sessions of the page, the check of every request, and the audit log."""
