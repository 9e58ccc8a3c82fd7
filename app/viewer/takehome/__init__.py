"""An arm as one HTML file that needs no server: for a disk, a learning platform or a slide."""

from app.viewer.takehome.page import LARGEST as LARGEST
from app.viewer.takehome.page import SavedArm as SavedArm
from app.viewer.takehome.page import save_page as save_page
from app.viewer.takehome.page import web_page as web_page
