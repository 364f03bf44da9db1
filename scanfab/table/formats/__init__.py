"""The file formats of tables: an object each, which reads, writes and says what it is."""
