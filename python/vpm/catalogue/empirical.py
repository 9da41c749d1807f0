"""Basis functions of a force without a law: the terms of which a formula for a residual is made."""

from types import MappingProxyType

#: Terms by name as text, in x (position), y (velocity), s (direction), phi (phase along the way) and u (load).
TERMS = MappingProxyType(
    {
        "constant": "1",
        "position": "x",
        "position_2": "x^2",
        "position_3": "x^3",
        "cosine": "cos(phi)",
        "sine": "sin(phi)",
        "viscous": "y",
        "speed_2": "y^2",
        "drag": "y|y|",
        "speed_3": "y^3",
        "viscous_position": "y x",
        "viscous_position_2": "y x^2",
        "dry": "s",
        "dry_position": "s x",
        "dry_position_2": "s x^2",
        "dry_cosine": "s cos(phi)",
        "dry_sine": "s sin(phi)",
        "load_dry": "|u| s",
        "load_cosine": "|u| cos(phi)",
        "load_sine": "|u| sin(phi)",
    }
)
