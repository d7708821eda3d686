"""What surrounds a job: configuration, records, logs, run lock, progress, verification."""
