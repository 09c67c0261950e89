"""The manual's office: what it looks for before it starts, and the demo."""
