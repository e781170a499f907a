"""The report: one HTML file with the plan, the schedules, and what a surveyor checks before trusting them."""
