"""The remainder: what effects leave of a residual, the states it depends on, and an empirical formula for it."""
