"""Files that connect actions to action servers, services and topics of any stack."""
