"""One arm in a viser scene: nodes are created once, afterwards only poses are assigned."""
