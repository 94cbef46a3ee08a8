"""How long a test waits for another process or thread before it counts it as hung.

What is awaited takes milliseconds to seconds. A machine that is busy with other work may need a hundred times that;
only a hang needs this long. No test expects anything to happen within a time.
"""

HANG_S = 900.0
