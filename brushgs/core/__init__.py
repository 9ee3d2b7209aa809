"""The compiled core, and what it needs of the machine: threads, memory, and signals that stop it."""
