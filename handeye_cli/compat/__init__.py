"""Functions with the names and arguments of other libraries, computed by this one."""
