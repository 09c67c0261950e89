"""A bag while it is recorded, of which little is lost when the recorder is killed."""
