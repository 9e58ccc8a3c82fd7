"""The parts of a visitor's page that its session makes and its features use."""
