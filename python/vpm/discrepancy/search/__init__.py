"""The search: rounds that accept one effect each, and backward elimination."""
