"""Robots: descriptions, kinematics, and checks for collisions."""
