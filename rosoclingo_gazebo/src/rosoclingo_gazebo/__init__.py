"""The office that the mailbot drives through."""
