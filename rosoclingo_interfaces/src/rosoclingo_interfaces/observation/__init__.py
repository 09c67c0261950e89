"""Observers: conditions on the messages of any topic, and the terms that are told of them."""
