"""HTTP, command line and web page; the only package that imports all others."""
