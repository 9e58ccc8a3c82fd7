"""Translates the kernels of an arm to C and JavaScript, for those who have no Python.

The very kernels that Kinboard runs are read as source:

1. :mod:`~kin.codegen.typing` turns them into typed trees, kernel by kernel and callees first. The subset of
   Python is small and closed (:mod:`~kin.codegen.subset`): what is outside is refused with file, line and what to
   write.
2. :mod:`~kin.codegen.rooms` finds the size of every array, so that C needs no heap.
3. :mod:`~kin.codegen.c` and :mod:`~kin.codegen.js` write the trees (:mod:`~kin.codegen.emit` is what they share).
4. :mod:`~kin.codegen.entries` are what generated code offers, kernels themselves, and
   :mod:`~kin.codegen.families` says how each family of closed forms is asked, :mod:`~kin.codegen.wrappers` how
   arms are that are solved as other ones; :mod:`~kin.codegen.arm` and :mod:`~kin.codegen.files` make one file.

Only `kin.generate` imports it, when it is called.
"""
