"""Closed loops: joints that close them, and what machines with closed loops do."""
