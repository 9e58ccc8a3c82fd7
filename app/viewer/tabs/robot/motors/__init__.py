"""*Motors* of the tab *Robot*: what the motors of the arm read, and how their signs and zeros are found."""
