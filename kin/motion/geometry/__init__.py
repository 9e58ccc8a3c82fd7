"""Where paths lead: curves of the tool or of the joints, corners between them, and the joint path that follows."""
