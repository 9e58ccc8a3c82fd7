"""Short pages of one title and a few lines, which the service writes itself: what to do, or what to wait for."""

from __future__ import annotations

import html


def short_page(title: str, body: str, *, root: str = "../", again: int | None = None) -> str:
    """A whole page, styled by ``static/short.css``.

    Args:
        title: text; also the heading.
        body: HTML.
        root: the service's root, relative to the page.
        again: seconds after which the page is loaded again. A refresh would not if the address has a fragment, as
            links of the viewer have.
    """
    script = "" if again is None else f'<script src="{root}static/again.js" data-after="{again}"></script>'
    title = html.escape(title)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8">{script}'
        '<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">'
        f'<title>{title}</title><link rel="stylesheet" href="{root}static/short.css">'
        f"<main><h1>{title}</h1>{body}</main></html>"
    )
