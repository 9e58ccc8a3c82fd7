"""The workspace tab: clouds of tool points, their sizes and section, and the capability map."""
