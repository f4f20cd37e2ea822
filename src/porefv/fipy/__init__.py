"""The fluid in the pores as a FiPy mesh, and a flow in FiPy's words: `mesh.to_fipy()`, `flow.to_fipy()`.

Importing this package does not import FiPy; its modules do.
"""
