"""What can be asked of the arm: positions, poses, twists, shapes."""
