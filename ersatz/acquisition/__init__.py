"""Numbers from objects: scans, shape concepts, geometry, expert distributions, tables."""
