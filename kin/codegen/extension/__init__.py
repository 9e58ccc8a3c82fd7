"""The extension `kin._kernels`: kernels translated to C and compiled ahead of time, called from Python.

1. :mod:`~kin.codegen.extension.wrappers` writes the kernels of a unit with, for each that Python calls, a row that
   says which arguments it takes, and a function that calls it with them.
2. ``module.c`` is the rest, written by hand: the one function that Python calls reads the arguments as a row says.
   It uses the stable ABI of Python 3.11, declared there, and no header of Python or NumPy.
3. :mod:`~kin.codegen.extension.build` translates, compiles and links, unit by unit.
"""
