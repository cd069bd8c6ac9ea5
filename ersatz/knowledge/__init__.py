"""The OWL knowledge base: vocabulary, storage, queries."""
