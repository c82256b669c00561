"""The same scene with one thing changed, solved again, and what that shows of its numbers."""
