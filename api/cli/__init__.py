"""The command line: one file per subcommand, heavy imports only inside the command that needs them."""
