"""The workspace over REST: clouds as files and as messages, sizes, reachability of targets, capability maps."""
