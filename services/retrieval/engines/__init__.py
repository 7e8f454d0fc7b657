"""What ranks beyond the memory of one process, behind the interface of the index in memory."""
