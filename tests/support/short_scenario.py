"""A scenario of a second and a half, for tests of what is done with its flights."""

SHORT = """
name = "short"
[[mission.step]]
do = "take-off"
height_m = 0.4
time_s = 1.0
[[mission.step]]
do = "hover"
time_s = 0.5
"""
