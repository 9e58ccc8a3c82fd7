"""The visitor's actions: what each event of the panel and the scene does to the page."""
