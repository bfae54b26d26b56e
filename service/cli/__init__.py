"""The command line `shape-edit`: the service's work on files, here or at a service elsewhere."""
