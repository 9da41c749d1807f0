"""Inputs that somebody has damaged: each is refused in one sentence, or leads to finite numbers within limits."""
