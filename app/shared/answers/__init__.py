"""Results of the core as plain dicts: what REST answers and what ``kinboard … --json`` prints; a module per topic.

The types are the contract: REST publishes them as its OpenAPI schemas (the string under a field is its
description), mypy checks the functions that fill them, and answers are not validated again at run time, so ten
thousand poses cost little more than printing their digits. Metres, radians and ``wxyz`` quaternions throughout.
"""
