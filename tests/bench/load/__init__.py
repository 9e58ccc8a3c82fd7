"""Figures under load, taken from outside: a service of its own process, clients that speak its protocols raw.

`python tests/bench/load MODE` starts `kinboard serve` on a free port, measures, prints a table and keeps
everything with ``--json``. Client and service share the machine, so the clients do as little as they can, and both
sides' processor time stands in the table. Quote figures of one run on an otherwise idle machine only.
"""
