"""What a page shows of a system, made of its messages. Needs no ROS and no web server."""
