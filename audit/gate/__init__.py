"""Gate files: what a mesh has to keep, chosen by the people who own it; `files.read_gate_file` makes a profile of one."""
