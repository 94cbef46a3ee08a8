"""What flights do at the edges of a platform: the response of nominal flights, and what effects add to it.

Effects of the height control and of the optical flow show there alone. `edge_response` measures thrust, speed and
height after an edge, and their mean and scatter in nominal flights; `edge_effects` has what an effect adds, from
simulated flights with it and without over such a platform. `signals.command_view` compares the two.
"""
