"""What the package needs of the machine and of Python, and knows nothing of physics."""
