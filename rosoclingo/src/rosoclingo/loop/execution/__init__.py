"""Execution of plans: who acts, which answer belongs to which action, and how long it takes."""
