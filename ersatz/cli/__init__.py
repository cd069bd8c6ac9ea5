"""The command line: thin; every command is a call of the library and a way to show its answer."""
