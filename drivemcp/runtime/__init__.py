"""Around the processes: supervision, logs, grants, watched folders."""
