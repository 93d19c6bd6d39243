"""The compiled equations: one function an element, and one for each family that finds it by the element's number.

An equation gets its parameters by name and the point at which the core is evaluated; it returns the force with its
slopes, and the partials by its parameters under the same names.
"""
