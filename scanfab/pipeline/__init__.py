"""From settings and frames to rows: the one room that knows all the steps."""
