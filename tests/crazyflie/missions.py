"""A mission of a few seconds: up, over a box, down."""

HOP = """
name = "hop"
[values]
clearance = 0.04
speed = 0.4
[world]
room_m = [-2.0, 3.5, -2.0, 2.0]
[[platform]]
size_m = [0.6, 3.0]
centre_m = [1.1, 0.0]
top_m = 0.46
[mission]
control = "position"
step = [{ do = "wait", time_s = 0.5 }, { do = "take-off", height_m = 0.5, time_s = 1.5 },
        { do = "hover", time_s = 1.5 }, { do = "go", distance_m = 2.0, speed_mps = 0.4 },
        { do = "hover", time_s = 0.5 }, { do = "land", time_s = 2.0 }]
"""
