"""Dampers as named physical elements on four paths: the table of elements, model files and the solver."""
