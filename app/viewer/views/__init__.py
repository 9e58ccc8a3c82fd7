"""HTML of the panel: Jinja2 templates, styled by ``static/viewer.css``, and MathML."""
