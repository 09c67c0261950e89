"""Observers: conditions on the messages of any topic, and the terms that announce them."""
