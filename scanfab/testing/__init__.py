"""Checks for readers and writers of packings of any package."""

from scanfab.testing.readers import check_reader
from scanfab.testing.writers import check_writer, differences, made_up_packings

__all__ = ["check_reader", "check_writer", "differences", "made_up_packings"]
