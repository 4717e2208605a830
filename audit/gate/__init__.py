"""Gate files: what a mesh has to keep, chosen by the people who own it; `loading.read_gate` makes a profile of one."""
