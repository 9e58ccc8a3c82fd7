"""Results of the core as REST answers them and ``kinboard … --json`` prints them; a module per topic.

`app.shared.answers.answer` says how a field is declared. Metres, radians and ``wxyz`` quaternions throughout.
"""
