//! Obstacle avoidance with a ring of sonars.
