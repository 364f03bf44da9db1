"""Readers: what the columns and files of each program mean; each is a plugin."""
