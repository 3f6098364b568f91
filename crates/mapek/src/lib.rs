//! Monitor, Analyze, Plan, Execute around Knowledge: the architecture of a robot.
