"""The report: every exhibit beside what was published, and the page that tells it."""
