"""Rival methods, one family a module; each says what it takes from its source and what it does not."""
