"""What REST, viewer and command line share: robots, settings, metrics, answers as dicts, computations."""
