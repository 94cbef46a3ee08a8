"""A batch spread over threads, processes or a cluster, and the folder that it is written to."""
