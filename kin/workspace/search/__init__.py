"""Search for extreme and nearest points of a workspace by descent."""
