"""Small readers: a file for each program, two where one would be too long."""
