"""The workspace tab: clouds of tool points in the picture, their sizes, their section."""
