//! Topics of ROS 1.
