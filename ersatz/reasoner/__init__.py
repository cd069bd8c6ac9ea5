"""Substitutes from knowledge: representative models, relevance, similarity, explanation."""
