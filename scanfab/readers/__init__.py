"""Readers: the only code that knows file formats; each is a plugin, the built-in ones included."""
