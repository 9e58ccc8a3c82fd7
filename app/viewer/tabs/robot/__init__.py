"""The tab in which a visitor makes an arm of their own."""
