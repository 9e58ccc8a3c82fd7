"""The (r, z) section of the workspace, as a plot in a panel of its own and as an outline in the scene."""
