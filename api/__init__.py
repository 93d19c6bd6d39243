"""HTTP, command line and web page; campaigns, jobs and their store; and the only wiring."""
