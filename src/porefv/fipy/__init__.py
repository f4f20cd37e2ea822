"""The pores as a FiPy mesh, and the pressure equation in FiPy's words: `mesh.to_fipy()`, `flow.to_fipy()`.

Importing this package does not import FiPy; its modules do.
"""
