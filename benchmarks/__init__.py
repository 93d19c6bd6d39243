"""Benchmarks of the figures in the documentation: `make bench` runs all of them."""
