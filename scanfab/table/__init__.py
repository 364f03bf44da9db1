"""The fabric table: rows, files of them, and tables side by side."""
