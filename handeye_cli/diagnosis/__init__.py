"""What is wrong with the data, and what they do not determine: verdicts instead of wrong numbers."""
