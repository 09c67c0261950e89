"""A simulator of a robot with navigation, for systems without Gazebo."""
