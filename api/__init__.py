"""The doors: HTTP, command line and web page; and the only wiring."""
