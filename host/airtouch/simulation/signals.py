"""What an effect may see: one vector a time step, by named places.

The simulator fills it in flight and the diagnosis fills it from a recorded log, so
that both run one implementation of an effect. SI units; body axes x forward, y left,
z up; world z up; rotors 1 front right, 2 rear right, 3 rear left, 4 front left.
A place that ends in a number of elements holds that many in a row.
"""

TIME = 0  #: s
STEP = 1  #: s, from this vector to the next
MASS = 2  #: kg
GRAVITY = 3  #: m/s^2
ROTOR_X = 4  #: 4, m, from the centre of mass
ROTOR_Y = 8  #: 4, m
ROTOR_RADIUS = 12  #: m
ROTOR_SPACING = 13  #: m, between neighbouring rotors
HOVER_SPEED = 14  #: rad/s, of one rotor in hover
VELOCITY = 15  #: 3, m/s, over ground, in body axes
RATES = 18  #: 3, rad/s, in body axes
ROTATION = 21  #: 9, body to world, row by row
THRUST = 30  #: 4, N, of each rotor in free air
ROTOR_SPEED = 34  #: 4, rad/s
LOWER_HEIGHT = 38  #: 4, m, rotor disc over the surface below
UPPER_HEIGHT = 42  #: 4, m, rotor disc over the higher surface that covers part of its disc
COVER = 46  #: 4, fraction of the disc over that higher surface, 0..1
LOWER_FACTOR = 50  #: 4, ground-effect factor of the lower surface's material
UPPER_FACTOR = 54  #: 4, the same of the higher surface
LOWER_ROUGHNESS = 58  #: 4, unsteadiness of the air over the surface
UPPER_ROUGHNESS = 62  #: 4, the same of the higher surface
ACCELERATION = 66  #: 3, m/s^2, of the centre of mass in world axes: dv/dt
HEIGHT = 69  #: m, over what is below: in flight of the lowest rotor, in a replay of the rotors by the down range
POSITION = 70  #: 3, m, of the centre of mass in the world; 0 where a log holds none
COUNT = 73  #: length of the vector
