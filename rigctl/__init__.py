"""Play an excitation on the rig and record it: transports, streaming, interlocks, player, run file."""
