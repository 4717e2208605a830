"""Gate files: what a mesh has to keep, chosen by its owners; `files.read_gate_file` makes a profile of one."""
