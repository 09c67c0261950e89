"""Models of systems for the page: tables and lines, made of messages. Needs neither ROS nor web."""
