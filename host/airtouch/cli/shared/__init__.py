"""What several commands share: the folder of flights, the progress bar, tables of scores."""
