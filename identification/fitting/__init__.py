"""Least squares over several runs, with exact gradients and honest uncertainty."""
