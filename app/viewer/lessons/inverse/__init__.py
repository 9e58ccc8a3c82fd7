"""The lesson "Inverse kinematics step by step": the closed form of an arm, derived with numbers."""
