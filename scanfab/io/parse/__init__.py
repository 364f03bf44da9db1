"""The syntax of files, and nothing of what it means."""
