"""An operator's console in the browser: sees what systems do, and says what they may do."""
