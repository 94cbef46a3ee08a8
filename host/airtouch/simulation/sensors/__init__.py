"""What is measured of it: IMU, down range, optical flow, Multi-ranger, and the row that reaches the log."""
