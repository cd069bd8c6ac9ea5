"""Symbols from numbers: sub-categorization, attribution, conceptualization."""
