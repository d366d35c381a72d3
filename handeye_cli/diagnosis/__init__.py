"""What is wrong with the data, and what they leave open: verdicts instead of wrong numbers."""
