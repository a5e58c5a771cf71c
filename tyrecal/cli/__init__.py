"""The command line: one command = one call into the library. Nothing heavy is imported here."""
