"""Writer plugins for packings."""
