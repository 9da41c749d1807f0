"""The search: rounds that accept one effect or a pair, backward elimination and forward steps."""
