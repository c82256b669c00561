"""The same scene with one thing changed, solved again, and what that tells of its numbers."""
