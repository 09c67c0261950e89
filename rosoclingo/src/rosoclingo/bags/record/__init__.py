"""Records a run in a bag, of which little is lost when the recorder is killed."""
