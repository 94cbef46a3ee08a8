"""Every table and figure of the paper's evaluation (section 7), reproduced: `airtouch paper`."""
