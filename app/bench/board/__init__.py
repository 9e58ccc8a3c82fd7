"""The scoreboard: a recorded run of the benchmark as a page.

Everything here is made from the JSON that ``kinboard bench --json`` writes, so that a page can be made of a run of
another machine or another day: no figure without a run behind it. :mod:`app.bench.board.views` reads the JSON,
:mod:`app.bench.board.picture` draws it, :mod:`app.bench.board.page` makes the page.
"""
