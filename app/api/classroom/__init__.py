"""The classroom over REST."""
