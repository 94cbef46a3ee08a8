"""What moves: rigid body, motors, battery, legs, and the forces on them."""
