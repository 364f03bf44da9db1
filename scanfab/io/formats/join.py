"""Moved to scanfab.io.contacts."""

from scanfab.io.contacts import count_walls as count_walls
from scanfab.io.contacts import join_ids as join_ids
from scanfab.io.contacts import join_positions as join_positions
from scanfab.io.contacts import rows_of_ids as rows_of_ids
