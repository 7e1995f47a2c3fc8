"""Scenarios: one run as data, read from YAML, checked as a whole, with the place of every mistake.

``load_scenario`` in ``loading.py`` is the way in; ``model.py`` is the format.
"""
