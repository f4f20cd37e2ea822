"""Accuracy against time and memory, on a scene of the user's."""
