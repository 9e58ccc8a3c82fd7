"""Which of the built-in arms a test is about.

Laws that hold for any arm loop over `kin.builtin_robots()`. What is told of closed forms, equations, singular
curves and golden inverse kinematics is told of the chapter's arms.
"""

CHAPTER_ARMS = ("pioneer5", "redundant7", "redundant7-craig")
