"""Whether two source trees give the same answers: a check for changes that should only make the core faster.

`python tests/bench/differential OLD [NEW]` asks both trees the same random questions, each in a process of its own
with its own kernels, and compares statuses, causes, branches, joint values and intervals. A tree is a folder that
contains `kin/`, or a commit. A question is its arm and number: ``--only panda --numbers 34`` asks it again and
prints both answers.

`robots` lists the arms, `questions` makes the questions with NumPy alone, `answers` asks them, `compare` and
`intervals` judge, `report` prints.
"""
