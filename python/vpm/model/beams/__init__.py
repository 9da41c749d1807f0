"""Flexible links: beams, their sections, levels of detail and gauges, and reduced solids."""
