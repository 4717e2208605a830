"""The HTML report: one file that shows an audit offline, with a 3-D view of the bad cells."""
