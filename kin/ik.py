"""Inverse kinematics with reasons. (types first; the pipeline follows)"""
