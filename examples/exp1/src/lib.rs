//! The first experiment of RoCS: reach the origin, avoid the box and a wandering robot.
