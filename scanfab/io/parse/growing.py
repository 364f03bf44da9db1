"""Moved to scanfab.io.text; these names go once nobody imports them from here."""

from scanfab.io.text import growing as growing
from scanfab.io.text import warn_incomplete as warn_incomplete
