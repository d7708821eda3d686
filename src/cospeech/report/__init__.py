"""The report: exhibits next to their published values, and the page that shows them."""
