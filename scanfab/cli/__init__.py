"""The command line: each command parses options, calls one library function, writes the result."""
